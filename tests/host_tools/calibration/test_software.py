"""The hash of the sources that run."""

from host_tools.calibration import certified_probe
from host_tools.calibration.certified_probe import source_sha256


def sources(folder, text="a = 1\n"):
    for name in ("device/a.py", "host_tools/b.py"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return folder


def test_the_same_sources_have_the_same_hash_wherever_they_lie(tmp_path, monkeypatch):
    hashes = set()
    for place in ("one", "two"):
        monkeypatch.setattr(certified_probe, "ROOT", sources(tmp_path / place))
        hashes.add(source_sha256())
    assert len(hashes) == 1


def test_a_changed_a_renamed_and_a_new_source_are_each_told(tmp_path, monkeypatch):
    monkeypatch.setattr(certified_probe, "ROOT", sources(tmp_path))
    hashes = [source_sha256()]
    (tmp_path / "device" / "a.py").write_text("a = 2\n")
    hashes.append(source_sha256())
    (tmp_path / "device" / "a.py").rename(tmp_path / "device" / "c.py")
    hashes.append(source_sha256())
    (tmp_path / "device" / "d.py").write_text("")
    hashes.append(source_sha256())
    assert len(set(hashes)) == 4
