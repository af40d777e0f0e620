# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # 06 Linked data and SPARQL
#
# The study wanted its annotation to be reusable by programs that know nothing of the one that
# made it. geofield writes plans as linked data with standard vocabularies (GeoSPARQL, PROV,
# DCAT, SOSA, SAREF4AGRI), and in the study's own vocabulary where that is asked for. Here a plan
# goes out as Turtle and is asked questions in SPARQL.

# %%
import tempfile
from pathlib import Path

import pandas as pd
import rdflib

import geofield as gf

pd.set_option("display.width", 140)
out = Path(tempfile.mkdtemp())
POINT = {"lat": 35.075373, "lon": 33.531142}
settings = gf.Settings(tracks={"spacing_m": 8.0, "step_m": 10.0})
plan = gf.plan_field("../sample_data/field_1.tif", **POINT, settings=settings)
plan.write(out, formats=["turtle"])
turtle = out / "field.ttl"
print(turtle.name, f"{turtle.stat().st_size / 1024:.0f} kB")

# %% [markdown]
# ## What it looks like
#
# One node per feature; its address is built from the field's place, a digest of the survey or plan
# it belongs to, and its number: the same after every run of the same work, and never shared with
# another picture's or spacing's. (Set a base address of your own before you publish.)

# %%
text = turtle.read_text(encoding="utf-8")
start = text.index("/obstacle/1> a ")
block = text[text.rindex("\n", 0, start) + 1 :].split(" .\n")[0]
print("\n".join(line if len(line) < 110 else line[:107] + "..." for line in block.splitlines()))

# %% [markdown]
# ## Questions
#
# The plan is a graph of rdflib, too: what any program gets from the file. Counts per class:

# %%
graph = plan.to_graph()
assert isinstance(graph, rdflib.Graph)
PREFIXES = """
PREFIX gf: <https://w3id.org/geofield#>
PREFIX geo: <http://www.opengis.net/ont/geosparql#>
PREFIX prov: <http://www.w3.org/ns/prov#>
PREFIX dcat: <http://www.w3.org/ns/dcat#>
PREFIX dc: <http://purl.org/dc/elements/1.1/>
PREFIX rdfs: <http://www.w3.org/2000/01/rdf-schema#>
"""


def ask(query):
    """The answer as a table."""
    answer = graph.query(PREFIXES + query)
    return pd.DataFrame(
        [[None if v is None else v.toPython() for v in row] for row in answer],
        columns=[str(name) for name in answer.vars],
    )


print(len(graph), "triples")
counts = ask(
    """
    SELECT ?class (COUNT(?x) AS ?n) WHERE {
      ?x a ?class . FILTER(STRSTARTS(STR(?class), "https://w3id.org/geofield#"))
    } GROUP BY ?class ORDER BY ?class
    """
)
counts["class"] = counts["class"].astype(str).str.removeprefix("https://w3id.org/geofield#")
print(counts.to_string(index=False))

# %% [markdown]
# The largest obstacles:

# %%
large = ask(
    """
    SELECT ?number ?radius WHERE {
      ?obstacle a gf:Obstacle ; gf:radiusInMetres ?radius ; gf:obstacleNo ?number .
    } ORDER BY DESC(?radius) LIMIT 5
    """
)
print(large.to_string(index=False))

# %% [markdown]
# Which obstacle opens how many gaps:

# %%
gaps = ask(
    """
    SELECT ?number (COUNT(?gap) AS ?gaps) (SUM(?length) AS ?metres) WHERE {
      ?gap a gf:Gap ; gf:causedBy ?obstacle ; geo:hasMetricLength ?length .
      ?obstacle a gf:Obstacle ; gf:obstacleNo ?number .
    } GROUP BY ?number ORDER BY DESC(?metres) LIMIT 5
    """
)
print(gaps.to_string(index=False))

# %% [markdown]
# Where the data come from, and on what terms:

# %%
print(
    ask(
        """
        SELECT ?picture ?rights ?software WHERE {
          ?data a dcat:Dataset ; prov:wasDerivedFrom ?image ; prov:wasGeneratedBy ?run .
          ?image rdfs:label ?picture . OPTIONAL { ?image dc:rights ?rights }
          ?run prov:wasAssociatedWith ?agent . ?agent rdfs:label ?software .
        }
        """
    ).to_string(index=False)
)

# %% [markdown]
# ## And back
#
# Linked data are no dead end: the plan reads back whole.

# %%
again = gf.read_plan(turtle)
print(len(again.obstacles), "obstacles,", len(again.tracks.segments), "segments")
assert again == plan

# %% [markdown]
# ## The study's vocabulary
#
# For programs that were written against the study's listings there is the profile `rdf-study`:

# %%
plan.write(out / "study", formats=["rdf-study"])
listing = (out / "study" / "obstacles.rdf").read_text(encoding="utf-8").splitlines()
start = next(n for n, line in enumerate(listing) if "Obstacle#no" in line or "obstacle:no" in line)
print("\n".join(line[:110] for line in listing[max(0, start - 6) : start + 12]))
