"""maturin, which never downloads a Rust toolchain unasked: without one, it says what is needed."""

import os

from maturin import *  # noqa: F403 - the hooks that a build backend has

os.environ.setdefault("MATURIN_NO_INSTALL_RUST", "1")
