"""Units of coordinate reference systems by their EPSG code.

Source: EPSG Geodetic Parameter Dataset v11.022 (2024-11-05, https://epsg.org), read through
PROJ 9.5.1: every projected, vertical and compound system, deprecated ones too, whose unit is not
the metre. Newer codes are looked up with pyproj, the extra ``crs``.
"""

from __future__ import annotations

import functools

from divespot.errors import DivespotError
from divespot.extras import extra
from divespot.io.units import STRETCHED, unit_of

#: Codes that were assigned after the tables were made.
_LATER = range(11_119, 20_000)

#: From here on, GeoTIFF codes are private.
_PRIVATE = range(32_768, 65_536)

#: World-wide Mercator and equidistant cylindrical systems: metres true on one parallel only.
_STRETCHED = "3388 3395 3752 3785-3786 3832 3857 3994 4087-4088 5641 32662-32663 900913"

_PROJECTED = {
    "us-ft": """
        2155 2194 2204 2225-2250 2254-2255 2257-2264 2267-2268 2271-2272 2274-2279 2283-2289
        2870-2895 2899-2900 2902-2908 2911-2912 2915-2920 2924-2930 2964-2968 3089 3091 3102
        3363 3365 3404 3417-3438 3441-3446 3451-3459 3485 3487 3490 3492 3494 3496 3498 3500
        3502 3504 3506 3508 3510 3512 3515 3517 3519 3521 3523 3525 3527 3529 3531 3533 3535
        3537 3539 3541 3543 3545 3547 3549 3551 3553 3560-3570 3582 3584 3586 3598 3600 3608
        3610 3612 3614 3616 3618 3620 3622 3624 3626 3628 3630 3632 3640 3642 3650 3652 3654
        3658 3660 3662 3664 3668 3670 3672 3674 3677 3680 3683 3686 3688 3690 3692 3696 3698
        3700 3728-3739 3753-3760 3991-3992 4217 4399-4413 4418-4433 4438-4439 4455-4457
        5623-5625 5646 5654-5655 6200-6202 6411 6413 6416 6418 6420 6422 6424 6426 6428 6430
        6432 6434 6436 6438 6441 6443 6445 6447 6449 6451 6453 6455 6457 6459 6461 6463 6465
        6467 6469 6471 6473 6475 6477 6479 6484 6486 6488 6490 6492 6501 6503 6505 6507 6510
        6517 6519 6521 6523 6525 6527 6529 6531 6533 6535 6537 6539 6541 6543 6549 6551 6553
        6555 6563 6565 6568 6572 6574 6576 6578 6582 6584 6586 6588 6590 6593 6595 6597 6599
        6601 6603 6605 6607 6609 6612 6614 6616 6618 6625-6627 6633 6880 6923 6925 6966 6997
        7057-7070 7128 7132 7258 7260 7262 7264 7266 7268 7270 7272 7274 7276 7278 7280 7282
        7284 7286 7288 7290 7292 7294 7296 7298 7300 7302 7304 7306 7308 7310 7312 7314 7316
        7318 7320 7322 7324 7326 7328 7330 7332 7334 7336 7338 7340 7342 7344 7346 7348 7350
        7352 7354 7356 7358 7360 7362 7364 7366 7368 7370 7407 7587-7645 8035-8036 8091 8093
        8096 8098 8100 8102 8104 8106 8108 8110 8112 8114 8116 8118 8120 8122 8124 8126 8128
        8130 8132 8134 8136 8138 8140 8142 8144 8146 8148 8150 8152 8154 8156 8158 8160 8162
        8164 8166 8168 8170 8172 8177 8180 8182 8185 8189 8193 8197 8200 8202 8204 8206 8208
        8210 8213 8216 8220 8224 8226 8380 8382 8384 8387 8518-8529 8531 8533-8536 8538-8540
        8712-8800 9748-9749 10481 10516 10622 23301-23333 26729-26760 26766-26787 26791-26799
        26801-26803 26811-26813 26847-26870 32001-32003 32005-32031 32033-32058 32064-32067
        32074-32077 32099 32164-32167 32664-32667
    """,
    "ft": """
        2222-2224 2251-2253 2256 2265-2266 2269-2270 2273 2280-2282 2867-2869 2896-2898 2901
        2909-2910 2913-2914 2921-2923 2992 2994 3080 3359 3361 3479 3481 3483 3588 3590 3593
        3605 3634 3636 3644 3646 3648 3656 3676 3679 3682 5588 6128-6129 6141 6391 6405 6407
        6409 6494 6496 6499 6515 6545 6547 6557 6559 6561 6570 6785 6787 6789 6791 6793 6795
        6797 6799 6801 6803 6805 6807 6809 6811 6813 6815 6817 6819 6821 6823 6825 6827 6829
        6831 6833 6835 6837 6839 6841 6843 6845 6847 6849 6851 6853 6855 6857 6859 6861 6863
        6868 6885 6887 7119-7127 8065-8068 8312 8314 8316 8318 8320 8322 8324 8326 8328 8330
        8332 8334 8336 8338 8340 8342 8344 8346 8348 8700-8711 20050
    """,
    "units of 1.0000135965 m": "29371 29373 29375 29377 29379 29381 29383 29385",
    "units of 0.9143985307444408 m": "24370-24374 24382",
    "units of 0.3047972654 m": "2314 3407 5589 24100",
    "units of 0.3047997101815088 m": "2136 2159-2160",
    "units of 0.201166195164 m": "2066 30200",
    "units of 0.201168 m": "3139-3140",
    "units of 0.9143984146160287 m": "27291-27292",
    "units of 20.116756 m": "3167",
    "units of 0.9143917962 m": "5472",
    "km": "22300",
    "units of 20.116782494375872 m": "24571",
    "units of 20.116765121552632 m": "29871",
    "units of 0.3047994715386762 m": "29872",
}
_VERTICAL = {
    "ft": "5614 6130-6132 8050-8051 8228 8897",
    "us-ft": "5702 6358-6360 8052-8053",
    "units of 0.3048007491 m": "5754",
}


def projected_unit(code: int) -> str | None:
    """Return the unit of x and y; None if the code is unknown."""
    return _known(code, {**_PROJECTED, STRETCHED: _STRETCHED})


def vertical_unit(code: int) -> str | None:
    """Return the unit of heights; None if the code is unknown."""
    return _known(code, _VERTICAL)


def _known(code: int, table: dict[str, str]) -> str | None:
    unit = next((unit for unit, codes in table.items() if code in _codes(codes)), None)
    if unit is not None or code in _PRIVATE:
        return unit
    return _asked(code) if code in _LATER else "m"


@functools.cache
def _codes(text: str) -> frozenset[int]:
    """Return the codes in a line of codes and of ranges, ends included."""
    ends = [list(map(int, part.split("-"))) for part in text.split()]
    return frozenset(code for part in ends for code in range(part[0], part[-1] + 1))


def _asked(code: int) -> str | None:
    """Return pyproj's unit for a code; None if pyproj is missing or does not know it."""
    try:
        pyproj = extra("pyproj", "crs", f"EPSG:{code} needs pyproj")
    except DivespotError:
        return None
    try:
        return unit_of(pyproj.CRS.from_epsg(code).axis_info[0].unit_conversion_factor)
    except (pyproj.exceptions.CRSError, IndexError):
        return None
