"""Arrays that exceed the memory raise ``MemoryError``; the interpreter continues."""

import subprocess
import sys

import pytest

pytest.importorskip("resource")

# Views of one number, with sizes beyond any memory.
SETUP = """
import resource
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
import numpy as np, morgana
large = np.broadcast_to(np.float32(1), (4000, 4000, 4000))
points = np.broadcast_to(np.zeros(3), (2 * 10**10, 3))
base = {"type": "scene", "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 4, "height": 4}},
        "light": {"type": "constant"}}
fog = {"type": "heterogeneous", "albedo": 0.5, "sigma_t": {"type": "gridvolume", "data": large}}
field = morgana.load_field({"type": "constant", "value": 1.5})
"""

WORK = {
    "scene": "morgana.load_dict({**base, 'm': {'type': 'cube', 'bsdf': {'type': 'null'}, 'interior': fog}})",
    "field": "morgana.load_field({'type': 'bspline', 'data': large, 'placement': 'nodes'})",
    "points": "field.n(points)",
    "rays": "morgana.trace(morgana.load_dict(base), points, [0, 0, 1])",
    "mesh": "morgana.load_dict({**base, 'm': {'type': 'mesh', 'vertex_positions': points, 'faces': [[0, 1, 2]]}})",
    "image": "morgana.write('large.exr', np.broadcast_to(np.float32(1), (60000, 60000, 3)))",
    "comparison": "morgana.compare(*[np.broadcast_to(np.float32(1), (100000, 100000, 3))] * 2)",
}


@pytest.mark.parametrize("name", WORK)
def test_arrays_beyond_all_memory(name, tmp_path):
    program = f"{SETUP}\ntry:\n    {WORK[name]}\nexcept MemoryError as error:\n    print('refused:', error)\nprint('still here')\n"
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert "refused:" in done.stdout and "still here" in done.stdout
    assert not list(tmp_path.iterdir())
