"""``python -m pipeline`` is ``wireval``."""

import sys

from pipeline.cli import main

sys.exit(main())
