"""A hook of mkdocs: pages name the pictures where the repository has them; in the site they lie beside the pages."""

from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

PICTURES = Path(__file__).resolve().parents[1] / "reports" / "pictures"


def on_files(files: Files, config: Any) -> Files:
    """Take in the pictures."""
    for path in sorted(PICTURES.glob("*.png")):
        files.append(File.generated(config, f"pictures/{path.name}", abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Point to them, from pages in folders too."""
    return markdown.replace("../reports/pictures/", "pictures/")
