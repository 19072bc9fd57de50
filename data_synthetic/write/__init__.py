"""A study as files that any other tool can read: volumes, manifest.toml, truth.json."""

from data_synthetic.write.study_files import (
    alone,
    earlier_files,
    edited,
    in_the_way,
    write_all_of_them,
    write_one_of,
    write_study,
)
from data_synthetic.write.volumes import FORMATS

__all__ = [
    "FORMATS",
    "alone",
    "earlier_files",
    "edited",
    "in_the_way",
    "write_all_of_them",
    "write_one_of",
    "write_study",
]
