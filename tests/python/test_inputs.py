"""Solids from other libraries, and what is refused."""

import copy
import pickle
import types

import numpy as np
import pytest

import ldi_ops as ldi


@pytest.fixture(scope="module")
def ball() -> ldi.Solid:
    return ldi.geodesic(radius=3, frequency=4)


def test_arrays_of_any_type_are_taken(ball):
    vertices, faces = ball.vertices, ball.faces
    for points, triangles in [
        (vertices, faces),
        (vertices.tolist(), faces.tolist()),
        (np.asfortranarray(vertices), faces.astype(np.int32)),
        (vertices[:, ::-1][:, ::-1], faces.astype(np.int64)),
    ]:
        assert float(ldi.load((points, triangles)).volume()) == float(ball.volume())
    assert np.shares_memory(ball.vertices, ball.vertices) and not ball.vertices.flags.writeable


def test_meshes_of_other_libraries_go_in_and_out(ball):
    trimesh, pyvista, meshio = (pytest.importorskip(name) for name in ("trimesh", "pyvista", "meshio"))
    vertices, faces = np.array(ball.vertices), ball.faces.astype(np.int64)
    volume = float(ball.volume())
    united = trimesh.Trimesh(vertices, faces, process=False)
    united.units = "parsec"
    with pytest.warns(UserWarning, match="parsec"):
        assert ldi.load(united).unit is None
    united.units = "mm"
    assert ldi.load(united).unit == "mm" and float(ldi.load(united).volume()) == volume
    assert float(ldi.load(pyvista.PolyData.from_regular_faces(vertices, faces)).volume()) == pytest.approx(volume, rel=1e-6)
    assert float(ldi.load(meshio.Mesh(vertices, [("triangle", faces)])).volume()) == volume
    image = ball.sample(resolution=32)
    assert image.to_trimesh().is_watertight
    assert image.to_pyvista().is_manifold
    assert image.to_xarray().sel(x=0, y=0, z=0, method="nearest").item() is True


def test_pyvista_meshes_have_an_accessor(ball):
    pyvista = pytest.importorskip("pyvista")
    mesh = pyvista.PolyData.from_regular_faces(np.array(ball.vertices), ball.faces.astype(np.int64))
    half = mesh.ldi.intersect(ldi.cuboid(min=(0, -9, -9), max=(9, 9, 9)))
    assert half.volume == pytest.approx(float(ball.volume()) / 2, rel=1e-5)
    assert mesh.ldi.volume().method == "exact"


class Vector:
    def __init__(self, point):
        self.x, self.y, self.z = point

    def toTuple(self):
        return self.x, self.y, self.z


class Tessellated:
    """A shape as CadQuery's: vertices as vectors, triangles as tuples."""

    def __init__(self, solid):
        self.solid = solid

    def vertices(self):
        raise AssertionError("build123d's shapes have this method, too")

    faces = vertices

    def tessellate(self, tolerance, angular_tolerance=0.1):
        return [Vector(point) for point in self.solid.vertices], [tuple(face) for face in self.solid.faces.tolist()]


def test_shapes_that_tessellate_are_taken(ball):
    assert float(ldi.load(Tessellated(ball), unit="mm").volume()) == float(ball.volume())
    moved = ball.transformed(np.hstack([np.eye(3), [[9], [0], [0]]]))
    plane = types.SimpleNamespace(vals=lambda: [Tessellated(ball), Tessellated(moved)])
    assert float(ldi.load(plane).volume()) == pytest.approx(2 * float(ball.volume()), rel=1e-12)


def test_voxels_make_a_solid_of_their_volume():
    voxels = np.random.default_rng(4).random((9, 7, 5)) < 0.4
    solid = ldi.from_voxels(voxels, spacing=(0.5, 0.25, 2), origin=(1, 2, 3), unit="um")
    assert float(solid.volume()) == voxels.sum() * 0.25 and solid.unit == "um"
    again = ldi.from_voxels(voxels, 1.0).sample(pitch=1.0)
    shifted = np.argwhere(again.to_numpy()) + np.round(again.origin).astype(int)
    assert (np.unique(shifted, axis=0) == np.argwhere(voxels)).all()
    for wrong in (np.zeros((3, 3, 3), bool), np.ones((3, 3), bool)):
        with pytest.raises(ldi.UsageError):
            ldi.from_voxels(wrong, 1.0)


def test_open_meshes_are_an_error_with_places(ball):
    with pytest.raises(ldi.NotClosed) as raised:
        ldi.load((ball.vertices, ball.faces[1:]), name="part")
    assert raised.value.places["open_edges"].shape == (3, 2, 3)
    assert raised.value.places["odd_edges"].shape == (0, 2, 3)
    assert isinstance(raised.value, ValueError) and isinstance(raised.value, ldi.Error)
    again = pickle.loads(pickle.dumps(raised.value))
    assert str(again) == str(raised.value) and again.name == raised.value.name


def test_solids_are_pickled_and_copied(ball):
    again = pickle.loads(pickle.dumps(ball))
    assert (again.name, again.unit) == (ball.name, ball.unit) and (again.vertices == ball.vertices).all()
    assert copy.copy(ball) is ball and copy.deepcopy([ball])[0] is ball
    with pytest.raises(TypeError, match="paths"):
        pickle.dumps(ball & ball)


@pytest.mark.parametrize(
    ("call", "error"),
    [
        (lambda: ldi.load("missing.stl"), ldi.InputError),
        (lambda: ldi.load(3), ldi.UsageError),
        (lambda: ldi.load((np.eye(3), np.eye(3))), ldi.UsageError),
        (lambda: ldi.load((np.eye(3), [[0, 1, -2]])), ldi.UsageError),
        (lambda: ldi.load((np.eye(3), [[0, 1, 7]])), ldi.NotClosed),
        (lambda: ldi.load((np.ones((4, 2)), [[0, 1, 2]])), ldi.UsageError),
        (lambda: ldi.geodesic(radius=-1), ldi.UsageError),
        (lambda: ldi.geodesic(raduis=1), TypeError),
        (lambda: ldi.geodesic().volume(resolutoin=3), TypeError),
        (lambda: ldi.geodesic().volume(resolution=3, pitch=1), ldi.UsageError),
        (lambda: ldi.geodesic().volume(axes="w"), ldi.UsageError),
        (lambda: ldi.geodesic().volume(backend="tpu"), ldi.UsageError),
        (lambda: ldi.geodesic().sample(axes="z", resolution=8).mesh(), ldi.UsageError),
        (lambda: ldi.geodesic().sample(axes="z", resolution=8).depths("x"), ldi.UsageError),
        (lambda: ldi.geodesic().offset(0.0), ldi.UsageError),
        (lambda: ldi.geodesic().offset(float("nan")), ldi.UsageError),
        (lambda: ldi.geodesic().opening(-1), ldi.UsageError),
        (lambda: ldi.geodesic().sample(resolution=-3), ldi.UsageError),
        (lambda: ldi.geodesic() & 3, TypeError),
        (lambda: ldi.clash([ldi.geodesic()]), TypeError),
        (lambda: (ldi.geodesic() - ldi.geodesic()).solid(), ldi.InputError),
        (lambda: ldi.from_voxels(np.full((2, 2, 2), np.nan), 1), ldi.UsageError),
        (lambda: ldi.from_voxels(np.full((2, 2, 2), -1), 1), ldi.UsageError),
        (lambda: ldi.from_voxels(np.ones((2, 2, 2)), (1, 1)), ldi.UsageError),
        (lambda: ldi.geodesic().with_unit("furlong"), ldi.UsageError),
        (lambda: ldi.clash({"a": ldi.geodesic()}), ldi.InputError),
    ],
)
def test_wrong_arguments_are_named(call, error):
    with pytest.raises(error) as raised:
        call()
    assert len(str(raised.value)) > 10


def test_units_are_stated_and_never_guessed(models, tmp_path):
    solid = ldi.load(models / "bone.stl")
    assert solid.unit is None and solid.volume().unit is None
    stated = ldi.load(models / "bone.stl", unit="millimetres")
    assert (stated.unit, stated.volume().unit) == ("mm", "mm³")
    assert stated.with_unit("in").unit == "in"
    with pytest.warns(UserWarning, match="state no unit"):
        assert (stated & solid).volume().unit == "mm³"
    stated.save(tmp_path / "bone.3mf")
    with pytest.warns(UserWarning, match="ignored"):
        assert ldi.load(tmp_path / "bone.3mf", unit="in").unit == "mm"
    assert ldi.load(tmp_path / "bone.3mf", unit="mm", name="femur").name == "femur"
