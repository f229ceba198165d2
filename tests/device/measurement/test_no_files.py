"""What measures opens no file: it is given contents, and device/files reads them."""

import re
from pathlib import Path

import device.measurement

OPENS = re.compile(r"\bopen\(|\.(read_bytes|read_text|write_bytes|write_text|exists|is_file|iterdir)\(|np\.(load|save)")
ON_THE_DISK = {"durable.py", "toml_record.py", "recording_file.py"}
"""Read and write files, and go to device/files, too."""


def test_no_module_of_measurement_opens_a_file():
    modules = Path(device.measurement.__file__).parent.rglob("*.py")
    found = {one.name: OPENS.findall(one.read_text(encoding="utf-8")) for one in modules if one.name not in ON_THE_DISK}
    assert len(found) > 25
    assert {name: calls for name, calls in found.items() if calls} == {}
