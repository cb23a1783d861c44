"""A slow reference implementation of LZF, with which the kernel is compared."""

from __future__ import annotations

LONGEST_RUN = 32
SHORTEST, LONGEST = 3, 264
FARTHEST = 1 << 13


def compress(data: bytes) -> bytes:
    """Take the last place where the next three bytes stood, as liblzf does."""
    packed, literals = bytearray(), bytearray()
    last: dict[bytes, int] = {}
    at = 0
    while at < len(data):
        key = data[at : at + SHORTEST]
        start = last.get(key, -FARTHEST)
        length = _same(data, start, at) if at - start <= FARTHEST and start >= 0 else 0
        last[key] = at
        if length < SHORTEST:
            literals.append(data[at])
            at += 1
            continue
        packed += _runs(literals) + _reference(at - start, length)
        literals.clear()
        at += length
    return bytes(packed + _runs(literals))


def _same(data: bytes, start: int, at: int) -> int:
    most = min(LONGEST, len(data) - at)
    return next((k for k in range(most) if data[start + k] != data[at + k]), most)


def _runs(literals: bytearray) -> bytes:
    pieces = (literals[k : k + LONGEST_RUN] for k in range(0, len(literals), LONGEST_RUN))
    return b"".join(bytes([len(piece) - 1, *piece]) for piece in pieces)


def _reference(distance: int, length: int) -> bytes:
    high, low = divmod(distance - 1, 256)
    short = min(length - 2, 7)
    more = bytes([length - 9]) if short == 7 else b""
    return bytes([short << 5 | high]) + more + bytes([low])


def decompress(packed: bytes) -> bytes | None:
    """Return what `packed` holds, a byte at a time; None where it is corrupt."""
    source = iter(packed)
    data = bytearray()
    try:
        for control in source:
            if control < LONGEST_RUN:
                data += bytes([next(source) for _ in range(control + 1)])
                continue
            length = (control >> 5) + 2 + (next(source) if control >> 5 == 7 else 0)
            distance = (control % 32) * 256 + next(source) + 1
            if distance > len(data):
                return None
            for _ in range(length):
                data.append(data[-distance])
    except (StopIteration, RuntimeError):
        return None
    return bytes(data)
