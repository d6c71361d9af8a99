"""Equations of pages: LaTeX becomes MathML when the site is built, so that browsers show it without scripts."""

import html
import logging
import re
from pathlib import Path

import ziamath
from fontTools import subset
from latex2mathml.converter import convert

LOG = logging.getLogger("mkdocs.hooks.equations")

EQUATION = re.compile(
    r'(?P<open>\(?)<(?P<tag>span|div) class="arithmatex">\\[(\[](?P<latex>.*?)\\[)\]]</(?P=tag)>(?P<close>[.,;:)]*)', re.DOTALL
)
"""An equation as pymdownx.arithmatex writes it: a span in a line, a div on separate lines."""
LABEL = re.compile(r"\\tag\{(.*?)\}")
UNLINKED = re.compile(r'(<div class="equation".*?</div>|<math.*?</math>|<code.*?</code>|<h\d.*?</h\d>|<a .*?</a>|<[^>]+>)', re.DOTALL)
"""Parts of a page in which labels do not become links."""

NAME = "<m[io]>(Hess|Im|Re|SE|arcsin|arctan|clamp|cos|det|diag|exp|ln|log|max|min|sin|sinc|tan|tr)</m[io]>"
FUNCTION = re.compile(
    rf"(?P<before></m\w+>)?(?:<msup>{NAME}(?P<power><m[ion]>[^<]*</m[ion]></msup>)|(?<!<msup>)(?<!<msub>){NAME})(?=(?P<after><m\w+)?)"
)
"""The name of a function, and the ends of its neighbours."""
PRIMED = re.compile(
    "<msup>(?P<base><mi>[^<]*</mi>)(?:<mrow>)?<mi>(?P<prime>&#x0203[2-4];)</mi>(?:(?P<power><mn>[^<]*</mn>)</mrow>)?</msup>"
    "|<msubsup>(?P<letter><mi>[^<]*</mi>)(?P<index><m[in]>[^<]*</m[in]>)<mi>(?P<mark>&#x0203[2-4];)</mi></msubsup>"
)
"""A letter with a prime. The prime of the font is high enough for text, and too small for a superscript."""
DELIMITERS = {
    r"\lvert": ("\ue001", "prefix", "|"),
    r"\rvert": ("\ue002", "postfix", "|"),
    r"\lVert": ("\ue003", "prefix", "‖"),
    r"\rVert": ("\ue004", "postfix", "‖"),
}
"""Bars, for which latex2mathml does not tell left from right, with the letters that stand for them in between."""

FONT = "equations.woff"
"""The font of equations, a part of STIX Two Math (SIL Open Font License): browsers space MathML by the tables of such a font."""
RADICAL = 0x221A
ITALIC = [0x210E, *range(0x1D434, 0x1D468), *range(0x1D6E2, 0x1D71C)]
"""Letters by which browsers show variables."""


def typeset(page: str, name: str) -> str:
    """Returns a page with its equations as MathML. Each mention of a label, such as (ray), links to its equation."""
    labels = [html.unescape(label) for label in LABEL.findall(page)]
    page = EQUATION.sub(lambda found: _equation(found, name), page)
    if not labels:
        return page
    mention = re.compile("|".join(re.escape(f"({label})") for label in labels))
    parts = UNLINKED.split(page)
    parts[::2] = [mention.sub(lambda found: f'<a href="#{_anchor(found[0])}">{found[0]}</a>', text) for text in parts[::2]]
    return "".join(parts)


def write_font(site: Path) -> None:
    """Writes the font with the letters of the equations of all pages."""
    letters = {RADICAL, *ITALIC}
    for page in site.rglob("*.html"):
        letters.update(
            ord(letter) for math in re.findall("<math.*?</math>", page.read_text(), re.DOTALL) for letter in html.unescape(math)
        )
    options = subset.Options(flavor="woff", layout_features=["*"], notdef_outline=True)
    font = subset.load_font(str(Path(ziamath.__file__).parent / "fonts/STIXTwoMath-Regular.ttf"), options)
    subsetter = subset.Subsetter(options)
    subsetter.populate(unicodes=letters)
    subsetter.subset(font)
    subset.save_font(font, str(site / FONT), options)


def _equation(found: re.Match[str], name: str) -> str:
    latex, is_display = html.unescape(found["latex"]).strip(), found["tag"] == "div"
    mathml = _mathml(LABEL.sub("", latex), is_display)
    if unknown := re.findall(r"\\[a-zA-Z]+", mathml):
        LOG.warning("%s: latex2mathml does not know %s in %s", name, ", ".join(unknown), latex)
    if not is_display:
        # Browsers would break lines between an equation and its punctuation.
        whole = found["open"] + mathml + found["close"]
        return mathml if whole == mathml else f'<span class="unbroken">{whole}</span>'
    tag = LABEL.search(latex)
    if tag is None:
        return f'<div class="equation">{mathml}</div>'
    label = f"({html.escape(tag[1], quote=False)})"
    return f'<div class="equation" id="{_anchor(label)}">{mathml}<span>{label}</span></div>'


def _mathml(latex: str, is_display: bool) -> str:
    # On GitHub, a backslash before punctuation is an escape. Pages therefore break lines with \cr.
    latex = latex.replace(r"\cr", r"\\").replace("{aligned}", "{split}").replace(r"\thinspace", r"\,")
    latex = re.sub(r"\\mathrel\{([+-])\}=", r"\\mathrel{\1=}", latex)
    for command, (letter, _, _) in DELIMITERS.items():
        # A bar may also be the target of \left and \right, which latex2mathml knows.
        latex = re.sub(rf"(?<!\\left)(?<!\\right){re.escape(command)}(?![a-zA-Z])", letter, latex)
    mathml = convert(latex, display="block" if is_display else "inline")
    for letter, form, bar in DELIMITERS.values():
        mathml = mathml.replace(f"<mi>{letter}</mi>", f'<mo form="{form}" stretchy="false" lspace="0" rspace="0">{bar}</mo>')
    mathml = PRIMED.sub(_primed, mathml)
    # The derivative's d and nabla are letters, which need no space.
    mathml = re.sub("<mo>(&#x022(?:02|07);)</mo>", r"<mi>\1</mi>", mathml)
    # Assignments are one operator.
    mathml = re.sub(r"<mo><mrow><mo>([^<]*)</mo><mo>&#x0003D;</mo></mrow></mo>", r"<mo>\1=</mo>", mathml)
    mathml = re.sub(r'columnalign="(\w+)"', r'style="text-align: \1; text-align: -webkit-\1"', mathml)
    return FUNCTION.sub(_spaced, mathml)


def _primed(found: re.Match[str]) -> str:
    letter, prime = found["base"] or found["letter"], found["prime"] or found["mark"]
    primed = f'<mrow>{letter}<mo lspace="0" rspace="0">{prime}</mo></mrow>'
    if found["power"]:
        return f"<msup>{primed}{found['power']}</msup>"
    return f"<msub>{primed}{found['index']}</msub>" if found["index"] else primed


def _spaced(found: re.Match[str]) -> str:
    """Returns the name of a function with spaces to neighbours that are neither operators nor brackets."""
    space = '<mspace width="0.17em" />'
    name = f"<mi>{found[2] or found[4]}</mi>"
    if found["power"]:
        name = f"<msup>{name}{found['power']}"
    before = found["before"] or ""
    return before + space * (before not in ("", "</mo>")) + name + space * (found["after"] not in (None, "<mo"))


def _anchor(label: str) -> str:
    return "equation-" + re.sub(r"[^a-z]+", "-", html.unescape(label).lower()).strip("-")
