"""Terms of imagery sources: what must be said with every product, and what is allowed."""

from __future__ import annotations

from dataclasses import dataclass

from geofield.errors import TermsError


@dataclass(frozen=True, slots=True)
class Terms:
    """What a source's owner asks for and allows; attribution and licence travel into products."""

    attribution: str = ""
    licence: str = ""
    #: Whether tiles may be kept on disk.
    may_cache: bool = False
    #: Whether geodata may be derived from the imagery.
    may_derive: bool = True
    #: Where the terms can be read.
    url: str = ""

    @property
    def cacheable(self) -> bool:
        """A source that forbids derivation is never cached, whatever else it says."""
        return self.may_cache and self.may_derive


def check_terms(name: str, terms: Terms, *, acknowledged: bool) -> None:
    """Refuse a source whose terms forbid derivation, unless the user takes responsibility."""
    if terms.may_derive or acknowledged:
        return
    where = f" ({terms.url})" if terms.url else ""
    raise TermsError(
        f"The terms of {name}{where} forbid image analysis and deriving geodata.",
        hint="If you have permission, repeat with --acknowledge-terms; else use open imagery: "
        "`geofield sources` lists some.",
    )
