"""The description of the package: README.md without the pictures and links that lead into the repository."""

import re
from pathlib import Path

from hatchling.metadata.plugin.interface import MetadataHookInterface

PICTURE = r"!\[[^\]]*\]\((?!https?:)[^)]*\)\n\n\*[^*]*\*\n\n"  # with its caption
LINK = r"\[([^\]]+)\]\((?!https?:)[^)]*\)"


class Description(MetadataHookInterface):
    """Hatchling calls it with the package's metadata."""

    def update(self, metadata: dict) -> None:
        """Add the description."""
        text = Path(self.root, "README.md").read_text(encoding="utf-8")
        text = re.sub(LINK, r"\1", re.sub(PICTURE, "", text))
        metadata["readme"] = {"content-type": "text/markdown", "text": text}
