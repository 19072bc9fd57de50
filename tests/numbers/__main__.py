"""Writes all kept numbers anew: ``make numbers``."""

import sys

from tests.numbers.kept import write
from tests.numbers.parts import PARTS

for part in sys.argv[1:] or PARTS:
    write(part, PARTS[part].scenes)
