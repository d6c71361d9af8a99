"""The Python code of the documents, as it stands there."""

import re

import pytest
from conftest import ROOT


@pytest.mark.parametrize("name", ["README.md", "docs/python.md"])
def test_examples_run(name, tmp_path, monkeypatch):
    blocks = re.findall(r"^```python\n(.*?)^```", (ROOT / name).read_text(), re.DOTALL | re.MULTILINE)
    assert blocks
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    monkeypatch.chdir(tmp_path)
    namespace = {}
    for block in blocks:
        exec(compile(block, name, "exec"), namespace)
    for result in (namespace.get("result"), namespace.get("picture")):
        assert result is None or result.image.mean() > 0.01
