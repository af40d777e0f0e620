"""The farm: many fields in one place, planned here or on a cluster."""

from geofield.farm.place_reader import read_places
from geofield.farm.places import Place, Places
from geofield.farm.stream import plan_fields
from geofield.farm.value import Farm, is_farm, read_farm

__all__ = ["Farm", "Place", "Places", "is_farm", "plan_fields", "read_farm", "read_places"]
