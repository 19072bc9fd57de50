"""Fill a template and write the page."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import jinja2

from reports.atomic import write_text


def write_page(template: str, page: Mapping[str, Any], path: Path) -> Path:
    """Render a template of this package with everything escaped; a name it misses is an error, not a gap."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
    )
    write_text(path, environment.get_template(template).render(page))
    return path
