"""Numbers for people, against the digits that a metrologist would write."""

from __future__ import annotations

import pytest

from divespot.numbers import rounded, volume_unit, with_uncertainty


@pytest.mark.parametrize(
    ("value", "u95", "text"),
    [
        (0.0281234, 0.00064, "0.02812 ± 0.00064"),
        (2312.4, 123.4, "2310 ± 120"),
        (84.26, 5.1, "84.3 ± 5.1"),
        (-293.2, 21.4, "-293 ± 21"),
        (0.028, 0.0, "0.02800 ± 0"),
        (0.028, float("nan"), "0.02800 ± nan"),
        (1.0, 0.0996, "1.000 ± 0.100"),
    ],
)
def test_uncertainty_decides_the_digits(value: float, u95: float, text: str) -> None:
    assert with_uncertainty(value, u95) == text


def test_nothing_is_less_than_zero_by_nothing() -> None:
    assert with_uncertainty(-1e-9, 0.1) == "0.00 ± 0.10"
    assert with_uncertainty(-0.0, 0.0) == "0 ± 0"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (0.0711111, "0.0711"),
        (1234.6, "1230"),
        (12.345, "12.3"),
        (-0.5, "-0.500"),
        (-0.0, "0"),
    ],
)
def test_three_digits(value: float, text: str) -> None:
    assert rounded(value) == text


def test_small_volumes_are_told_in_litres() -> None:
    assert volume_unit(0.0099) == ("L", 1000.0)
    assert volume_unit(0.01) == ("m³", 1.0)
