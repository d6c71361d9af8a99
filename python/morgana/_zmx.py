"""Reader of lenses in Zemax files: see :func:`morgana.lens.read_zmx`."""

from __future__ import annotations

import math
import os
from typing import Any, Dict, List, Mapping, NoReturn, Optional, Tuple, Union

from ._errors import FileError
from ._glass import Glass
from ._materials import Dispersion, known_glass
from ._prescription import Material, Prescription, Surface
from ._system import DEPARTURES, GradError

UNITS = {"MM": 1e-3, "CM": 1e-2, "IN": 0.0254, "METER": 1.0, "M": 1.0}
"""Lengths of the units of UNIT in metres."""

MAX_WHOLE = 10**6
"""Largest count or number of a row in a file."""

Row = Tuple[int, List[str]]
"""Number of a line, and its words."""

GRADIENTS: Dict[str, Tuple[str, str, Tuple[str, ...]]] = {
    "GRINSUR1": ("n", "n0 + r2*(x^2+y^2)", ("n0", "r2")),
    "GRINSUR2": (
        "n2",
        "n0 + r2*(x^2+y^2) + r4*(x^2+y^2)^2 + r6*(x^2+y^2)^3 + r8*(x^2+y^2)^4 + r10*(x^2+y^2)^5 + r12*(x^2+y^2)^6",
        ("n0", "r2", "r4", "r6", "r8", "r10", "r12"),
    ),
    "GRINSUR3": (
        "n",
        "n0 + r2*(x^2+y^2) + r4*(x^2+y^2)^2 + r6*(x^2+y^2)^3 + z1*z + z2*z^2 + z3*z^3",
        ("n0", "r2", "r4", "r6", "z1", "z2", "z3"),
    ),
}
"""Gradients by the type of their surface: formula for n or n², and the names of PARM 2, 3, …; PARM 1
is a length of steps."""

TYPES = ("STANDARD", "EVENASPH", *GRADIENTS)
"""Types of surfaces that can be read."""

NON_CIRCULAR = ("OBSC", "SQAP", "SQOB", "ELAP", "ELOB", "SPID")
"""Apertures of surfaces that are not openings with a circular rim."""


def read_zmx(path: Union[str, "os.PathLike[str]"], *, glasses: Optional[Mapping[str, Union[float, Glass, Dispersion]]] = None) -> Prescription:
    """Read a lens from a Zemax file (``.zmx``).

    The reader takes sequential files of rotationally symmetric lenses: the surface types STANDARD,
    EVENASPH, GRINSUR1, GRINSUR2 and GRINSUR3; the lines UNIT,
    WAVM, WAVL, PWAV, FTYP (angles and object heights), XFLN, YFLN, ENPD, FNUM, FLOA, NAME, STOP,
    CURV, CONI, DISZ, DIAM, GLAS, CLAP and FLAP. An unknown glass with an index and an Abbe number
    in its line becomes :meth:`Glass.model` only if it is a model glass (``___BLANK``). Other lines
    do not change rays and are ignored.

    Parameters
    ----------
    path : path
        File in UTF-8, or in UTF-16 with a byte order mark.
    glasses : mapping, optional
        Indices or glasses by the names in the file, before built-in ones and those of
        :func:`catalog_glass`.

    Returns
    -------
    Prescription
        The lens.

    Raises
    ------
    FileError
        File that cannot be read.
    GradError
        Unsupported surface, field or aperture, unknown glass, or number that cannot be read, with
        its line.

    Examples
    --------
    >>> triplet = morgana.lens.read_zmx("triplet.zmx", glasses={"N-SSK2": 1.622})
    """
    name = os.fspath(path)
    try:
        with open(path, "rb") as file:
            data = file.read()
    except OSError as error:
        raise FileError(f"{name}: {error.strerror or error}") from None
    try:
        text = data.decode("utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    return _File(name, text, glasses or {}).prescription()


class _File:
    """Lines of a file: of the lens, and of each surface, by their first word."""

    def __init__(self, name: str, text: str, glasses: Mapping[str, Union[float, Glass, Dispersion]]) -> None:
        self.name, self.glasses = name, {key.upper(): value for key, value in glasses.items()}
        self.lens: Dict[str, List[Row]] = {}
        self.surfaces: List[Dict[str, List[Row]]] = []
        into = self.lens
        for number, line in enumerate(text.splitlines(), 1):
            words = line.split()
            if not words:
                continue
            if words[0] == "SURF":
                into = {"SURF": [(number, words)]}
                self.surfaces.append(into)
            elif into is self.lens or line[:1].isspace():
                into.setdefault(words[0], []).append((number, words))
            else:
                # Lines without an indent end the surfaces.
                into = self.lens
                into.setdefault(words[0], []).append((number, words))
        if len(self.surfaces) < 3:
            raise GradError(f"{name}: found {len(self.surfaces)} surfaces (SURF), but a lens needs an object, a surface and an image")

    def fail(self, row: Row, message: str) -> NoReturn:
        raise GradError(f"{self.name}:{row[0]}: {message}")

    def number(self, row: Row, at: int, default: Optional[float] = None) -> float:
        """Returns the number at a position of a line."""
        words = row[1]
        if at >= len(words) and default is not None:
            return default
        word = words[at] if at < len(words) else "nothing"
        if word.upper() == "INFINITY":
            return math.inf
        try:
            value = float(word)
        except ValueError:
            value = math.nan
        if math.isnan(value):
            self.fail(row, f"{words[0]} has {word!r} where a number must be")
        return value

    def whole(self, row: Row, at: int, default: Optional[float] = None) -> int:
        """Returns the whole number at a position of a line."""
        value = self.number(row, at, default)
        if not (math.isfinite(value) and value == int(value) and abs(value) <= MAX_WHOLE):
            self.fail(row, f"{row[1][0]} has {value:g} where a whole number must be")
        return int(value)

    def word(self, row: Row, at: int = 1) -> str:
        """Returns the word at a position of a line."""
        if at >= len(row[1]):
            self.fail(row, f"{row[1][0]} has nothing behind it")
        return row[1][at]

    def one(self, rows: Dict[str, List[Row]], key: str) -> Optional[Row]:
        """Returns the last line of a key, or ``None``."""
        return rows[key][-1] if key in rows else None

    def prescription(self) -> Prescription:
        lens = self.lens
        mode = self.one(lens, "MODE")
        if mode is not None and mode[1][1:2] != ["SEQ"]:
            self.fail(mode, f"mode {' '.join(mode[1][1:])}: only sequential lenses (MODE SEQ) can be read")
        stops = [i for i, rows in enumerate(self.surfaces) if "STOP" in rows]
        if stops and not 0 < stops[0] < len(self.surfaces) - 1:
            self.fail(self.surfaces[stops[0]]["STOP"][-1], "the object or the image is the stop, but another surface must be")
        kept = self.surfaces[1:-1]
        surfaces = [self.surface(rows, i in stops) for i, rows in enumerate(kept, 1)]
        distance = self.thickness(self.surfaces[0])
        wavelengths, primary = self.wavelengths()
        title = self.one(lens, "NAME")
        given: Dict[str, Any] = {
            **self.pupil(),
            "fields": self.fields(math.isinf(distance)),
            "wavelengths": wavelengths,
            "primary": primary,
            "object_distance": distance,
            "object_medium": self.material(self.surfaces[0]),
            "metres_per_unit": self.unit(),
            "name": "" if title is None else " ".join(title[1][1:]),
        }
        if given.pop("by_stop"):
            stop = stops[0] if stops else 1
            row = self.one(self.surfaces[stop], "DIAM")
            if row is None:
                raise GradError(f"{self.name}: the stop sets the pupil (FLOA), but surface {stop} has no DIAM")
            surfaces[stop - 1] = surfaces[stop - 1]._replace(aperture=self.number(row, 1))
        try:
            return Prescription(surfaces, **given)
        except (GradError, ValueError) as error:
            raise GradError(f"{self.name}: {error}") from None

    def label(self, rows: Dict[str, List[Row]]) -> str:
        """Returns the number of a surface, as the file states it."""
        return " ".join(rows["SURF"][0][1][1:2])

    def thickness(self, rows: Dict[str, List[Row]]) -> float:
        row = self.one(rows, "DISZ")
        return 0.0 if row is None else self.number(row, 1)

    def surface(self, rows: Dict[str, List[Row]], stop: bool) -> Surface:
        row = self.one(rows, "TYPE")
        kind = "STANDARD" if row is None else self.word(row)
        if row is not None and kind not in TYPES:
            self.fail(row, f"surface {self.label(rows)} has the type {kind}, which is not supported: the types are {', '.join(TYPES)}")
        parameters = {self.whole(one, 1): (one, self.number(one, 2)) for one in rows.get("PARM", [])}
        for key in NON_CIRCULAR:
            if key in rows:
                self.fail(rows[key][-1], f"the aperture {key} is not supported: apertures must be circles (CLAP, FLAP)")
        curvature = self.one(rows, "CURV")
        conic = self.one(rows, "CONI")
        c = 0.0 if curvature is None else self.number(curvature, 1)
        return Surface(
            radius=1 / c if c else math.inf,
            thickness=self.thickness(rows),
            material=self.gradient(kind, parameters) if kind in GRADIENTS else self.material(rows),
            conic=0.0 if conic is None else self.number(conic, 1),
            aperture=self.opening(rows),
            stop=stop,
            aspheric=self.aspheric(parameters) if kind == "EVENASPH" else (),
        )

    def aspheric(self, parameters: Dict[int, Tuple[Row, float]]) -> Tuple[float, ...]:
        """Returns the coefficients of r², r⁴, … of an EVENASPH."""
        for order, (row, value) in parameters.items():
            if not 1 <= order <= DEPARTURES and value:
                self.fail(row, f"EVENASPH has the coefficient {value:g} of r^{2 * order}: the orders are r^2 to r^{2 * DEPARTURES}")
            if not math.isfinite(value):
                self.fail(row, f"EVENASPH has {value:g} where a finite number must be")
        values = [parameters[i][1] if i in parameters else 0.0 for i in range(1, DEPARTURES + 1)]
        while values and not values[-1]:
            values.pop()
        return tuple(values)

    def gradient(self, kind: str, parameters: Dict[int, Tuple[Row, float]]) -> Material:
        of, formula, names = GRADIENTS[kind]
        values = {name: parameters[i][1] if i in parameters else 0.0 for i, name in enumerate(names, 2)}
        return {"type": "expression", of: formula, **values}

    def opening(self, rows: Dict[str, List[Row]]) -> Optional[float]:
        row = self.one(rows, "CLAP")
        if row is not None:
            if self.number(row, 1, 0.0):
                self.fail(row, "a clear aperture with an inner radius is not supported")
            return self.number(row, 2)
        row = self.one(rows, "DIAM")
        return self.number(row, 1) if "FLAP" in rows and row is not None else None

    def material(self, rows: Dict[str, List[Row]]) -> Union[str, float, Glass, Dispersion]:
        row = self.one(rows, "GLAS")
        if row is None:
            return "air"
        name = self.word(row)
        if name.upper() == "MIRROR":
            self.fail(row, f"surface {self.label(rows)} is a mirror, which is not supported")
        if name.upper() in self.glasses:
            return self.glasses[name.upper()]
        if name.startswith("___"):
            return Glass.model(self.number(row, 4), self.number(row, 5))
        try:
            return known_glass(name)
        except GradError as error:
            self.fail(row, f"{error}: glasses={{{name!r}: …}}")

    def unit(self) -> float:
        row = self.one(self.lens, "UNIT")
        if row is None:
            return 1e-3
        if self.word(row) not in UNITS:
            self.fail(row, f"unit {self.word(row)!r} but must be one of {', '.join(UNITS)}")
        return UNITS[self.word(row)]

    def pupil(self) -> Dict[str, Any]:
        for key, name in (("ENPD", "entrance_pupil"), ("FNUM", "f_number")):
            row = self.one(self.lens, key)
            if row is not None:
                if key == "FNUM" and self.number(row, 2, 0.0):
                    self.fail(row, "a paraxial working f-number (FNUM … 1) is not supported: give ENPD, FNUM … 0 or FLOA")
                return {name: self.number(row, 1), "by_stop": False}
        if "FLOA" not in self.lens:
            raise GradError(f"{self.name}: the pupil has no size: there is no ENPD, FNUM or FLOA")
        return {"by_stop": True}

    def wavelengths(self) -> Tuple[List[float], int]:
        count = self.counts()[1]
        primary = self.one(self.lens, "PWAV")
        found: List[float] = []
        if "WAVM" in self.lens:
            by_number = {self.whole(row, 1): 1e3 * self.number(row, 2) for row in self.lens["WAVM"]}
            found = [by_number[i] for i in sorted(by_number)]
        elif "WAVL" in self.lens:
            row = self.lens["WAVL"][-1]
            found = [1e3 * self.number(row, i) for i in range(1, len(row[1]))]
        if not found:
            raise GradError(f"{self.name}: there are no wavelengths (WAVM or WAVL)")
        found = found[:count] if count else list(dict.fromkeys(found))
        first = 1 if primary is None else self.whole(primary, 1)
        if not 1 <= first <= len(found):
            raise GradError(f"{self.name}: the primary wavelength is {first} of {len(found)} (PWAV)")
        return found, first - 1

    def counts(self) -> Tuple[int, int]:
        """Returns the numbers of fields and wavelengths in FTYP; 0 if it does not have them."""
        row = self.one(self.lens, "FTYP")
        return (0, 0) if row is None else (self.whole(row, 3, 0.0), self.whole(row, 4, 0.0))

    def fields(self, at_infinity: bool) -> List[Tuple[float, float]]:
        row = self.one(self.lens, "FTYP")
        kind = 0 if row is None else self.whole(row, 1)
        if row is not None and kind not in (0, 1):
            self.fail(row, f"field type {kind} is not supported: the types are 0 (angles) and 1 (object heights)")
        if row is not None and at_infinity == (kind == 1):
            self.fail(row, f"fields are {'heights, but the object is at infinity' if kind else 'angles, but the object is not at infinity'}")
        count = self.counts()[0]
        x, y = ([] if one is None else [self.number(one, i) for i in range(1, len(one[1]))] for one in (self.one(self.lens, "XFLN"), self.one(self.lens, "YFLN")))
        size = count or max(len(x), len(y), 1)
        points = [(x[i] if i < len(x) else 0.0, y[i] if i < len(y) else 0.0) for i in range(size)]
        return points if count else list(dict.fromkeys(points))
