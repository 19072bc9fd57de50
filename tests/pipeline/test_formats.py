"""Every variant of the format study, and the files that pydicom tests itself with."""

from __future__ import annotations

from pathlib import Path

import pydicom
import pytest

from pipeline.load import LoadError, load, read_header
from tests.studies.formats import Variant, outcome, variants

VARIANTS = variants()
OTHERS = sorted((Path(pydicom.__file__).parent / "data" / "test_files").glob("*.dcm"))


@pytest.mark.filterwarnings("ignore")  # writers warn of what is wrong on purpose
@pytest.mark.parametrize("variant", VARIANTS, ids=lambda variant: variant.name)
def test_it_is_right_or_noted_or_refused(tmp_path: Path, variant: Variant) -> None:
    found = outcome(variant, tmp_path)
    assert not found.startswith("wrong"), found


def test_the_table_is_large() -> None:
    assert len(VARIANTS) >= 120
    assert len({variant.name for variant in VARIANTS}) == len(VARIANTS)


@pytest.mark.parametrize("path", OTHERS, ids=lambda path: path.name)
def test_files_of_others_are_read_or_refused_in_a_sentence(path: Path) -> None:
    try:
        volume = load(read_header(path))
    except LoadError as error:
        assert path.name in str(error)  # noqa: PT017
    else:
        assert min(volume.shape) >= 2
