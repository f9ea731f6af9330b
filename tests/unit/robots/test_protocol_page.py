import re
from binascii import crc_hqx
from pathlib import Path

PAGE = Path(__file__).parents[3] / "docs" / "robots" / "protocol.md"


def test_checksums_in_the_example_of_the_protocol_page_are_right():
    lines = re.findall(
        r"^    (?:PC|robot) +(.+)\*([0-9A-F]{4})$", PAGE.read_text(encoding="utf-8"), re.MULTILINE
    )
    assert len(lines) == 4
    assert [f"{crc_hqx(text.encode(), 0xFFFF):04X}" for text, _ in lines] == [
        seal for _, seal in lines
    ]
