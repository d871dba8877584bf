"""The programs of docs/python.md run, and print what the comments say."""

import contextlib
import io
import re
import shutil
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROGRAMS = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "python.md").read_text(), flags=re.S)


def test_the_guide_has_programs():
    assert len(PROGRAMS) >= 5


@pytest.mark.parametrize("program", PROGRAMS)
def test_programs_of_the_guide_run(program, tmp_path, monkeypatch):
    (tmp_path / "data").mkdir()
    shutil.copytree(ROOT / "data" / "models", tmp_path / "data" / "models")
    monkeypatch.chdir(tmp_path)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(program, "docs/python.md", "exec"), {"__name__": "guide"})
    said = re.findall(r"^\s*print\(\w+\)\s+# ([^ ].*)$", program, flags=re.M)
    assert all(line in printed.getvalue() for line in said), (said, printed.getvalue())


def test_the_guide_states_outputs():
    assert len(re.findall(r"print\(\w+\)\s+# [^ ]", "".join(PROGRAMS))) >= 2
