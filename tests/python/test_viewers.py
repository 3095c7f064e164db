# SPDX-License-Identifier: BSD-3-Clause
"""dyntape.bridges.viewers: what arrives in meshcat, rerun and viser, without a display."""

import dyntape
import numpy as np
import pytest
from conftest import CONFIG, page_section
from dyntape.bridges import viewers

FILE = CONFIG / "robots" / "pendulum.urdf"


@pytest.fixture
def pendulum():
    return dyntape.load(FILE)


def world_tip(pendulum, q):
    return np.array([np.sin(q), 0, -np.cos(q)])


@pytest.mark.parametrize("kind, volume", [("box", 24.0), ("cylinder", np.pi * 2 * 3 * 4), ("sphere", 4 / 3 * np.pi * 24)])
@pytest.mark.parametrize("mirror", [1, -1])
def test_triangles_enclose_their_shape(kind, volume, mirror):
    points, corners = viewers.triangles(dyntape.Shape("link", kind, np.eye(4), np.array([2.0, 3.0, mirror * 4.0])))
    a, b, c = (points[corners[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(volume, rel=0.02)


def test_meshcat(pendulum, monkeypatch):
    library = pytest.importorskip("meshcat")

    class Window:
        """In the place of its server: what is sent."""

        def __init__(self):
            self.sent = []

        def send(self, command):
            self.sent.append(command.lower())

    scene = library.Visualizer.__new__(library.Visualizer)
    scene.window, scene.path = Window(), library.path.Path(("meshcat",))
    view = viewers.meshcat(pendulum, scene=scene)
    sent = scene.window.sent
    objects = [message for message in sent if message["type"] == "set_object"]
    assert [message["path"] for message in objects] == ["/meshcat/pendulum/rod/cylinder_0", "/meshcat/pendulum/tip/sphere_1"]
    assert all(message["object"]["geometries"] for message in objects)
    view.show([0.5])
    tip = [message for message in sent if message["type"] == "set_transform" and message["path"] == "/meshcat/pendulum/tip"][-1]
    np.testing.assert_allclose(np.reshape(tip["matrix"], (4, 4)).T[:3, 3], world_tip(pendulum, 0.5), atol=1e-12)
    view.play([0, 0.5, 1], [[0.0], [0.5], [1.0]])
    animations = sent[-1]
    assert animations["type"] == "set_animation" and {entry["path"] for entry in animations["animations"]} == {"/meshcat/pendulum/rod", "/meshcat/pendulum/tip"}


def test_rerun(pendulum, tmp_path):
    library = pytest.importorskip("rerun")
    recording = library.RecordingStream("test")
    recording.save(str(tmp_path / "motion.rrd"))
    view = viewers.rerun(pendulum, scene=recording)
    view.play(np.linspace(0, 1, 11), np.linspace(0, 1, 11)[:, None])
    recording.flush()
    del recording
    data = (tmp_path / "motion.rrd").read_bytes()
    assert len(data) > 1000
    for word in b"Mesh3D", b"Transform3D":
        assert word in data


def test_viser(pendulum):
    library = pytest.importorskip("viser")
    server = library.ViserServer(port=0, verbose=False)
    try:
        view = viewers.viser(pendulum, scene=server, name="mine")
        view.show([0.5])
        tip = view.handles["mine/tip"]
        np.testing.assert_allclose(tip.position, world_tip(pendulum, 0.5), atol=1e-6)
        view.play([0, 0.01, 0.02], [[0.0], [0.5], [1.0]])
        np.testing.assert_allclose(tip.position, world_tip(pendulum, 1.0), atol=1e-6)
    finally:
        server.stop()


def test_what_cannot_be_shown(pendulum):
    pytest.importorskip("rerun")
    bare = dyntape.assemble("bare", [dyntape.Body("hinge", mass=1.0, com=[1, 0, 0])])
    with pytest.raises(dyntape.ArgumentError, match='the robot "bare" has no shapes'):
        viewers.rerun(bare)
    view = viewers.rerun(pendulum)
    with pytest.raises(dyntape.ArgumentError, match=r"expected t \(samples,\) and q \(samples, 1\)"):
        view.play([0, 1], [0.0, 1.0])


def test_the_page():
    pytest.importorskip("rerun")
    names = {}
    exec(page_section("Viewers"), names)
    assert len(names["view"].shapes) == 2
