"""Translation: one context for all words of the plugin, read from Qt's own .ts files.

The files of translators are read as they are: nothing needs compiling, and the package carries
no binaries.
"""

from __future__ import annotations

import re
from pathlib import Path

from qgis.PyQt.QtCore import QCoreApplication, QLocale, QTranslator
from qgis.PyQt.QtXml import QDomDocument

from . import description

CONTEXT = "geofield"
FOLDER = Path(__file__).with_name("i18n")
_SENTENCES = re.compile(r"(?<=\.) (?=[A-Z])")
#: Numbers with a point, as the engine writes them; not those of a file's name.
_NUMBER = re.compile(r"(?<![\w./-])(\d+)\.(\d+)(?= (?:m|m²|ha|km|%)(?!\w)|\)|[,;.]? |$)", re.ASCII)


def tr(text: str) -> str:
    """A text in the language of QGIS: one of the plugin's own, or what the engine said."""
    return QCoreApplication.translate(CONTEXT, text)


def number(value: float, digits: int) -> str:
    """A number as it is written in the language of QGIS."""
    return QLocale().toString(float(value), "f", digits)


class Words(QTranslator):
    """The words of one language.

    Parameters
    ----------
    language : str
        Two letters, such as ``de``.
    """

    def __init__(self, language: str) -> None:
        super().__init__()
        self.words: dict[str, str] = {}
        self._said = [
            (re.compile(pattern, re.ASCII), re.sub(r"\$(\d)", r"\\g<\1>", said))
            for pattern, said in description.said(language)
        ]
        self._point = QLocale(language).decimalPoint()
        file = FOLDER / f"geofield_{language}.ts"
        if not file.is_file():
            return
        document = QDomDocument()
        document.setContent(file.read_text(encoding="utf-8"))
        nodes = document.elementsByTagName("message")
        for number in range(nodes.count()):
            node = nodes.at(number)
            target = node.firstChildElement("translation")
            if target.attribute("type") != "unfinished" and target.text():
                self.words[node.firstChildElement("source").text()] = target.text()

    def isEmpty(self) -> bool:
        """Whether there is no translation at all."""
        return not self.words

    def translate(
        self, context: str, text: str, disambiguation: str | None = None, number: int = -1
    ) -> str | None:
        """The translation of a text; None for what is not the plugin's.

        An empty text would be taken for the translation: QGIS's own words were blank.
        """
        return self.words.get(text) or self._told(text) if context == CONTEXT else None

    def _told(self, text: str) -> str:
        """What the engine said, as a whole or sentence by sentence, where it is known."""
        sentences = _SENTENCES.split(text)
        for count in range(len(sentences), 0, -1):
            first, rest = " ".join(sentences[:count]), " ".join(sentences[count:])
            for pattern, said in self._said:
                found = pattern.fullmatch(first)
                if found:
                    local = _NUMBER.sub(rf"\1{self._point}\2", found.expand(said))
                    return f"{local} {self._told(rest)}" if rest else local
        first, *others = sentences
        return f"{first} {self._told(' '.join(others))}" if others else text
