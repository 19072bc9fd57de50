"""A study as files that any other tool can read: volumes, manifest.toml, truth.json."""

from data_synthetic.write.study_files import earlier_files, in_the_way, write_study
from data_synthetic.write.volumes import FORMATS

__all__ = ["FORMATS", "earlier_files", "in_the_way", "write_study"]
