"""Which tests `make loop` runs for a module."""

import pytest
import room as module
from room import room


@pytest.fixture
def tree(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "ROOT", tmp_path)
    for name in (
        "device/web/app.py", "device/web/deep/one.py", "device/config.py", "device/errors.py", "README.md",
        "tests/device/web/test_app.py", "tests/device/web/test_events.py", "tests/device/test_config.py",
    ):  # fmt: skip
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()


@pytest.mark.parametrize(
    ("file", "tests"),
    [
        ("device/web/app.py", ["tests/device/web/test_app.py", "tests/device/web"]),
        ("device/web/deep/one.py", ["tests/device/web"]),
        ("device/config.py", ["tests/device/test_config.py"]),
        ("device/errors.py", ["tests/device/test_config.py"]),
        ("tests/device/web/test_events.py", ["tests/device/web/test_events.py"]),
    ],
)
def test_a_modules_room_is_the_folder_that_mirrors_its_own(tree, file, tests):
    assert room(file) == tests


@pytest.mark.parametrize("file", ["", "device/web", "device/web/none.py", "README.md", "/etc/hostname"])
def test_what_is_no_module_is_refused(tree, file):
    with pytest.raises(ValueError, match="must be a module of this repository"):
        room(file)
