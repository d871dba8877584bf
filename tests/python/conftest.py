"""Fixtures of the tests of the Python package."""

from pathlib import Path

import pytest

import ldi_ops as ldi

MODELS = Path(__file__).parents[2] / "data" / "models"


@pytest.fixture(scope="session")
def models() -> Path:
    return MODELS


@pytest.fixture(scope="session")
def gyroid() -> ldi.Solid:
    return ldi.load(MODELS / "gyroid_sheet.stl", unit="mm")


@pytest.fixture(scope="session")
def bone() -> ldi.Solid:
    return ldi.load(MODELS / "bone.stl", unit="mm")
