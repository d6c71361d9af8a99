"""Files of samples with their place, and folders of OpenFOAM."""

from __future__ import annotations

import contextlib
import os
from typing import IO, Callable, Dict, Iterator, Optional, Protocol, Sequence, Set, Tuple
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray


class Samples(Protocol):
    """What is written."""

    @property
    def values(self) -> NDArray[np.float64]:
        """[z, y, x]."""

    @property
    def spacing(self) -> Tuple[float, float, float]:
        """Along x, y, z."""

    @property
    def origin(self) -> Tuple[float, float, float]:
        """Of the first sample."""

    @property
    def name(self) -> str:
        """Of the array."""


def _numbers(values: Sequence[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


def _npy(path: str, samples: Samples) -> None:
    with _whole(path) as file:
        np.save(file, samples.values)


def _nrrd(path: str, samples: Samples) -> None:
    """Raw samples, the axes listed from the fastest on."""
    directions = (f"({','.join(repr(float(h)) if i == j else '0' for j in range(3))})" for i, h in enumerate(samples.spacing))
    lines = [
        "NRRD0004",
        "type: double",
        "dimension: 3",
        f"sizes: {' '.join(str(n) for n in samples.values.shape[::-1])}",
        "endian: little",
        "encoding: raw",
        "space dimension: 3",
        f"space directions: {' '.join(directions)}",
        f"space origin: ({','.join(repr(float(x)) for x in samples.origin)})",
        "centers: node node node",
    ]
    with _whole(path) as file:
        file.write(("\n".join(lines) + "\n\n").encode())
        file.write(samples.values.astype("<f8").tobytes())


def _vti(path: str, samples: Samples) -> None:
    """One array of point data, raw and appended."""
    data = samples.values.astype("<f8").tobytes()
    extent = " ".join(f"0 {n - 1}" for n in samples.values.shape[::-1])
    header = f"""<?xml version="1.0"?>
<VTKFile type="ImageData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
  <ImageData WholeExtent="{extent}" Origin="{_numbers(samples.origin)}" Spacing="{_numbers(samples.spacing)}">
    <Piece Extent="{extent}">
      <PointData>
        <DataArray type="Float64" Name={quoteattr(samples.name)} format="appended" offset="0"/>
      </PointData>
    </Piece>
  </ImageData>
  <AppendedData encoding="raw">
   _"""
    with _whole(path) as file:
        file.write(header.encode() + len(data).to_bytes(8, "little") + data)
        file.write(b"\n  </AppendedData>\n</VTKFile>\n")


WRITERS: Dict[str, Callable[[str, Samples], None]] = {".vti": _vti, ".nrrd": _nrrd, ".npy": _npy}
"""What writes samples, by the extension of the file."""


def is_decomposed(case: str, time: Optional[float]) -> bool:
    """Whether an OpenFOAM case has this time, or its last, in the folders of its parts alone."""
    whole, parts = _instants(case), _instants(os.path.join(case, "processor0"))
    if not parts:
        return False
    if not os.path.isdir(os.path.join(case, "constant", "polyMesh")):
        return True
    wanted = max(whole | parts) if time is None else time
    return wanted in parts and wanted not in whole


def _instants(folder: str) -> Set[float]:
    """Times of the folders in a folder whose names are numbers."""
    found = set()
    with contextlib.suppress(OSError):
        for entry in os.scandir(folder):
            with contextlib.suppress(ValueError):
                found.add(float(entry.name))
    return found


@contextlib.contextmanager
def _whole(path: str) -> Iterator[IO[bytes]]:
    """A file that takes its name once it is complete."""
    part = f"{path}.{os.getpid()}.part"
    try:
        with open(part, "xb") as file:
            yield file
        os.replace(part, path)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(part)
        raise
