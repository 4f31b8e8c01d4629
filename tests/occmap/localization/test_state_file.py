"""What a saved state may name, and what becomes of a damaged one."""

import gzip
from pathlib import Path

import pytest

from occmap.localization import SlamLocalizer
from occmap.localization.state_file import MAGIC, load, save


def called(module: str, name: str) -> bytes:
    """A pickle that calls something without arguments, found as protocol 4 finds it."""
    words = b"".join(b"\x8c" + bytes([len(word)]) + word.encode() for word in (module, name))
    return b"\x80\x04" + words + b"\x93)R."


@pytest.mark.parametrize(
    ("module", "name"),
    [
        ("occmap.localization.compass", "np.testing._private.extbuild.subprocess.Popen"),
        ("occmap.localization.state_file", "gzip.GzipFile"),
        ("occmap.localization.state_file", "Path"),
        ("occmap.localization.state_file", "load"),
        ("subprocess", "Popen"),
        ("numpy", "save"),
    ],
)
def test_a_file_may_name_nothing_but_the_classes_of_this_package(tmp_path: Path, module: str, name: str):
    (tmp_path / "state").write_bytes(MAGIC + gzip.compress(called(module, name)))
    with pytest.raises(ValueError, match="which no saved state does"):
        load(tmp_path / "state")


def test_a_file_may_name_a_class_where_it_is_defined(tmp_path: Path):
    (tmp_path / "state").write_bytes(MAGIC + gzip.compress(called("occmap.localization.track", "Track")))
    with pytest.raises(ValueError, match="holds a Track, not a SlamLocalizer"):
        load(tmp_path / "state")


def test_a_damaged_file_is_refused_wherever_the_damage_is(tmp_path: Path):
    save(tmp_path / "state", SlamLocalizer())
    whole = (tmp_path / "state").read_bytes()
    for at in range(len(MAGIC) + 10, len(whole) - 16, 16):  # behind gzip's own header
        middle = bytes(byte ^ 0xFF for byte in whole[at : at + 16])
        (tmp_path / "state").write_bytes(whole[:at] + middle + whole[at + 16 :])
        with pytest.raises(ValueError, match="is damaged"):
            load(tmp_path / "state")
