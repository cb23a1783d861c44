"""libusb for Open3D on machines that have none."""

from __future__ import annotations

import ctypes
from ctypes.util import find_library

import libusb_package


def preload() -> None:
    """Load the packaged libusb where the system has none; Open3D's wheels link to it."""
    if find_library("usb-1.0") is None:
        ctypes.CDLL(str(libusb_package.get_library_path()), ctypes.RTLD_GLOBAL)
