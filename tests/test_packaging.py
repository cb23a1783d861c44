"""Building downloads no Rust unasked."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


def test_without_rust_nothing_more_is_asked_for(tmp_path: Path) -> None:
    pytest.importorskip("maturin")
    environment = {name: text for name, text in os.environ.items() if "MATURIN" not in name}
    environment |= {"PATH": str(tmp_path), "PYTHONPATH": str(ROOT / "packaging")}
    code = "import backend; print(backend.get_requires_for_build_wheel())"
    done = subprocess.run(  # noqa: S603 - our own code
        [sys.executable, "-c", code],
        cwd=ROOT,
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == "[]\n"


def test_no_file_chooses_a_toolchain() -> None:
    assert not list(ROOT.glob("rust-toolchain*"))
    assert 'rust-version = "1.89"' in (ROOT / "Cargo.toml").read_text("utf-8")
