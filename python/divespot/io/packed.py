"""A scan inside a GZIP or a ZIP file."""

from __future__ import annotations

import zipfile
import zlib
from io import BytesIO
from pathlib import PurePath

from divespot.errors import DivespotError, damaged

_GZIP, _ZIP = b"\x1f\x8b", b"PK\x03\x04"
#: zlib's window for a GZIP header.
_GZIP_BITS = 31
#: Largest ratio of unpacked to packed size, and the size in bytes up to which it does not matter.
_LARGEST_RATIO, _ALWAYS_BYTES = 100, 256 << 20


def unpacked(path: PurePath, data: bytes) -> tuple[PurePath, bytes]:
    """Return name and bytes of the scan inside; path and data themselves if it is not packed.

    An NPZ file is a ZIP file too, and is returned as it is.

    Raises
    ------
    DivespotError
        The file is damaged, holds several files, or would become too large.

    """
    if data.startswith(_GZIP):
        inner = path.with_suffix("") if path.suffix.lower() == ".gz" else path
        return inner, _gunzipped(data)
    if data.startswith(_ZIP):
        return _unzipped(path, data)
    return path, data


def require_size(unpacked_bytes: int, packed_bytes: int) -> None:
    """Raise DivespotError if a file would unpack to implausibly many bytes."""
    if unpacked_bytes > max(_largest(packed_bytes), _ALWAYS_BYTES):
        raise DivespotError(
            f"it would unpack to {unpacked_bytes >> 20} MB, over {_LARGEST_RATIO} times its size, "
            "as corrupt files do: an unpacked file is needed"
        )


def _largest(packed_bytes: int) -> int:
    return _LARGEST_RATIO * packed_bytes


def _gunzipped(data: bytes) -> bytes:
    limit = max(_largest(len(data)), _ALWAYS_BYTES)
    parts, held = [], 0
    rest = data
    try:
        while rest.startswith(_GZIP):
            stream = zlib.decompressobj(_GZIP_BITS)
            parts.append(stream.decompress(rest, limit + 1 - held))
            held += len(parts[-1])
            require_size(held, len(data))
            if not stream.eof:
                raise damaged("its GZIP body ends too early")
            rest = stream.unused_data
    except zlib.error as err:
        raise damaged(f"its GZIP body cannot be unpacked ({err})") from None
    return b"".join(parts)


def _unzipped(path: PurePath, data: bytes) -> tuple[PurePath, bytes]:
    with open_zip(data) as archive:
        members = [m for m in archive.infolist() if not _is_litter(m)]
        if any(member.filename.endswith(".npy") for member in members) or path.suffix == ".npz":
            return path, data
        if len(members) != 1:
            names = ", ".join(member.filename for member in members[:5]) or "none"
            raise DivespotError(
                f"it holds {len(members)} files ({names}): one scan per ZIP is needed"
            )
        return PurePath(members[0].filename), read_member(archive, members[0])


def _is_litter(member: zipfile.ZipInfo) -> bool:
    name = PurePath(member.filename)
    return member.filename.endswith("/") or "__MACOSX" in name.parts or name.name.startswith(".")


def open_zip(data: bytes) -> zipfile.ZipFile:
    """Open an archive.

    Raises
    ------
    DivespotError
        The archive is damaged.

    """
    try:
        return zipfile.ZipFile(BytesIO(data))
    # zipfile documents no exceptions, and raises a dozen kinds on damaged archives.
    except Exception as err:  # noqa: BLE001
        raise _not_readable(err) from None


def read_member(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> bytes:
    """Return the bytes of a member, after checking its stated size.

    Raises
    ------
    DivespotError
        The member is damaged, encrypted or too large.

    """
    require_size(member.file_size, member.compress_size)
    try:
        return archive.read(member)
    except MemoryError:
        raise
    # As above; an encrypted archive raises RuntimeError.
    except Exception as err:  # noqa: BLE001
        raise _not_readable(err) from None


def _not_readable(err: Exception) -> DivespotError:
    return damaged(f"not a readable ZIP archive ({err})")
