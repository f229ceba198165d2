"""Text on a printed page: in a font that lies on the machine, with every character that the font has not as its code.

A reference whose characters print as empty boxes would be anybody's. Nothing that people wrote is markup: the library's
paragraphs would load pictures that a text names.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

from reportlab import rl_config
from reportlab.lib.styles import ParagraphStyle
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont
from reportlab.platypus import Paragraph

DEJAVU = Path("/usr/share/fonts/truetype/dejavu")
"""Where Debian's fonts-dejavu-core has its files, which provisioning installs."""
OWN = Path(rl_config.__file__).parent / "fonts"
"""The library's own fonts, for a machine without those; they have the letters of western Europe only."""
FAMILY = {"Page": ("DejaVuSans.ttf", "Vera.ttf"), "Page-Bold": ("DejaVuSans-Bold.ttf", "VeraBd.ttf")}


def register_fonts(folder: Path = DEJAVU) -> None:
    """Make the fonts known to the library under the names of `FAMILY`, those of `folder` where it has both."""
    has_both = all((folder / wanted).is_file() for wanted, _ in FAMILY.values())
    for name, (wanted, own) in FAMILY.items():
        pdfmetrics.registerFont(TTFont(name, folder / wanted if has_both else OWN / own))


def printable(text: str, font: str) -> str:
    """Return text with each character that a registered font cannot draw as <U+4E2D>, and any space as one."""
    drawn: Any = pdfmetrics.getFont(font).face.charToGlyph
    return "".join(one if ord(one) in drawn else " " if one.isspace() else f"<U+{ord(one):04X}>" for one in text)


def paragraph(text: str, style: ParagraphStyle) -> Paragraph:
    """Return text as it was written, its lines as lines."""
    lines = [escape(printable(line, style.fontName)) for line in text.split("\n")]
    return Paragraph("<br/>".join(lines), style)
