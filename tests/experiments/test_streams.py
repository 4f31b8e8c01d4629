"""Laws of the named random streams."""

import subprocess
import sys

import pytest

from experiments.streams import Streams


def draws(streams: Streams, name: str) -> list[float]:
    return streams.generator(name).random(4).tolist()


def test_a_stream_depends_on_the_seed_and_its_name_alone():
    assert draws(Streams(3), "lidar") == draws(Streams(3), "lidar")
    assert draws(Streams(3), "lidar") != draws(Streams(4), "lidar")
    assert draws(Streams(3), "lidar") != draws(Streams(3), "odometry")


def test_drawing_from_one_stream_leaves_the_others_alone():
    streams = Streams(3)
    before = draws(streams, "odometry")
    streams.generator("lidar").random(1000)
    assert draws(streams, "odometry") == before


def test_a_child_is_a_family_of_its_own():
    streams = Streams(3)
    assert draws(streams.child("lidar"), "noise") == draws(streams.child("lidar"), "noise")
    assert draws(streams.child("lidar"), "noise") != draws(streams, "noise")
    assert draws(streams.child("lidar"), "noise") != draws(streams.child("odometry"), "noise")


def test_another_process_draws_the_same():
    code = "from experiments.streams import Streams; print(Streams(3).integer('building'))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert int(out.stdout) == Streams(3).integer("building")


def test_a_negative_seed_is_refused():
    with pytest.raises(ValueError, match="-1"):
        Streams(-1)
