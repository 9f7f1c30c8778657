# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python module: python3 qmat_test.py SOURCE_FOLDER PROGRAM, with $PYTHONPATH and $QMAT_LIBRARY."""
import base64
import copy
import json
import multiprocessing
import os
import pickle
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest
from pathlib import Path

import numpy as np

import qmat

source, program = Path(sys.argv.pop(1)), sys.argv.pop(1)

# A box of 2 x 1 x 1, counter-clockwise from outside.
BOX_V = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 2)], float)
BOX_F = np.array([[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7], [0, 4, 2],
                  [2, 4, 6], [1, 3, 5], [3, 7, 5]])

# A medial mesh in memory, and its envelope.
OF_SPHERES = """
qmat: 1
nodes:
  given: { type: medial.read }
  skin: { type: medial.skin, in: { medial: given.medial } }
outputs: { skin: skin.mesh }
"""


def ball(rings=24):
    """A ball of radius 2 around (1, 0, 0)."""
    polar, turn = np.meshgrid(np.pi * np.arange(1, rings) / rings, np.pi * np.arange(2 * rings) / rings, indexing="ij")
    ring = np.stack([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)], -1).reshape(-1, 3)
    n, faces = 2 * rings, []
    last = 1 + (rings - 1) * n
    for s in range(n):
        t = (s + 1) % n
        faces.append([0, 1 + s, 1 + t])
        faces.append([last, last - n + t, last - n + s])
        for r in range(rings - 2):
            a, b = 1 + r * n, 1 + (r + 1) * n
            faces += [[a + s, b + s, b + t], [a + s, b + t, a + t]]
    return np.array([1, 0, 0]) + 2 * np.vstack([[0, 0, 1], ring, [0, 0, -1]]), np.array(faces)


def write_off(path, V, F):
    with open(path, "w") as file:
        file.write(f"OFF\n{len(V)} {len(F)} 0\n")
        file.writelines(" ".join(map(repr, v)) + "\n" for v in V.tolist())
        file.writelines("3 " + " ".join(map(str, f)) + "\n" for f in F.tolist())


def write_gltf(path, meshes):
    """A scene with a node for each mesh: name to V, F."""
    data, views, accessors = b"", [], []
    for V, F in meshes.values():
        for table, kind, type, least in ((V, "f", "VEC3", {"min": V.min(0).tolist(), "max": V.max(0).tolist()}),
                                         (F.reshape(-1, 1), "I", "SCALAR", {})):
            part = struct.pack(f"<{table.size}{kind}", *table.ravel().tolist())
            views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(part)})
            accessors.append({"bufferView": len(views) - 1, "componentType": 5126 if kind == "f" else 5125,
                              "count": len(table), "type": type, **least})
            data += part
    scene = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(meshes)))}],
             "nodes": [{"name": name, "mesh": i} for i, name in enumerate(meshes)],
             "meshes": [{"name": name, "primitives": [{"attributes": {"POSITION": 2 * i}, "indices": 2 * i + 1}]}
                        for i, name in enumerate(meshes)],
             "accessors": accessors, "bufferViews": views,
             "buffers": [{"byteLength": len(data),
                          "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}]}
    Path(path).write_text(json.dumps(scene))


class InAFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.addCleanup(os.chdir, os.getcwd())
        os.chdir(folder.name)


class Declarations(unittest.TestCase):
    def test_those_of_the_module_are_those_of_the_header(self):
        header = (source / "graphs" / "qmat.h").read_text()
        header = re.sub(r"/\*.*?\*/", "", header, flags=re.S)
        header = re.sub(r'^#.*|^extern "C".*|^}$|QMAT_API', "", header, flags=re.M)
        declared = header.split(), qmat._DECLARATIONS.split()
        self.assertGreater(len(declared[0]), 200)
        self.assertEqual(" ".join(declared[0]), " ".join(declared[1]))


class OfArrays(unittest.TestCase):
    def test_a_ball_is_described_within_epsilon(self):
        V, F = ball()
        m = qmat.mat(V, F, epsilon=.02)
        diagonal = np.linalg.norm(V.max(0) - V.min(0))
        self.assertAlmostEqual(m.errors.diagonal, diagonal)
        self.assertAlmostEqual(m.errors.epsilon, .02 * diagonal)
        self.assertTrue(m.errors.certified)
        self.assertLessEqual(max(m.errors[:2]), m.errors.epsilon)
        self.assertEqual(m.spheres.shape, (len(m.radii), 4))
        self.assertEqual((m.cones.dtype, m.cones.shape[1], m.slabs.shape[1]), (np.uint32, 2, 3))
        reach = np.linalg.norm(m.centres - [1, 0, 0], axis=1) + m.radii
        self.assertLessEqual(reach.max(), 2 + m.errors.epsilon)
        self.assertLessEqual(abs(m.radii.max() - 2), 2 * m.errors.epsilon)
        # No vertex is farther from the envelope than the bound; the farthest point is near one, on a fine surface.
        errors = m.error_at(V)
        self.assertEqual(errors.shape, (len(V),))
        self.assertLessEqual(errors.max(), m.errors.surface_to_envelope)
        self.assertGreaterEqual(errors.max(), .5 * m.errors.surface_to_envelope)
        self.assertEqual(m.solid.vertices.shape, V.shape)
        self.assertEqual(m.report["summary"]["spheres"], len(m.spheres))

    def test_any_layout_and_kind_of_numbers_gives_the_same(self):
        coarse = {"samples.spacing": "10%"}
        m = qmat.mat(BOX_V, BOX_F, epsilon=.05, set=coarse)
        for V, F in ((np.asfortranarray(BOX_V, np.float32), BOX_F.astype(np.int16)),
                     (BOX_V.tolist(), BOX_F.tolist()), (np.hstack([BOX_V, BOX_V])[:, 3:], np.flipud(np.flipud(BOX_F)))):
            other = qmat.mat(V, F, epsilon=.05, threads=2, set=coarse)
            np.testing.assert_array_equal(other.spheres, m.spheres)
            np.testing.assert_array_equal(other.cones, m.cones)

    def test_a_medial_mesh_in_memory_has_the_distances_of_a_capsule(self):
        graph = qmat.Graph(text=OF_SPHERES)
        graph.give("given.medial", [[0, 0, 0, 1], [4, 0, 0, 1]], [[1, 0], [0, 1]])
        capsule = graph.run("given.medial", "skin")
        medial = capsule["given.medial"]
        self.assertEqual(medial.cones.tolist(), [[0, 1]])
        self.assertEqual(medial.slabs.shape, (0, 3))
        np.testing.assert_allclose(medial.error_at([[2, 3, 0], [7, 0, 0], [-1, 0, 1], [2, 0, 0], [3, 1, 0]]),
                                   [2, 2, 2 ** .5 - 1, -1, 0], atol=1e-12)
        skin = capsule["skin"]
        distance = np.linalg.norm(skin.vertices - np.clip(skin.vertices[:, :1], 0, 4) * [1, 0, 0], axis=1)
        np.testing.assert_allclose(distance, 1, atol=.02)
        # A slab brings its sides.
        graph.give("given.medial", np.eye(3, 4), [], [[2, 1, 0]])
        slab = graph.run("given.medial")["given.medial"]
        self.assertEqual((slab.cones.tolist(), slab.slabs.tolist()), ([[0, 1], [0, 2], [1, 2]], [[0, 1, 2]]))
        # Results stay as they are when the graph goes on.
        self.assertEqual(medial.error_at([[2, 3, 0]])[0], 2)

    def test_colliders_of_a_box_have_its_mass_and_contain_it(self):
        m = qmat.mat(BOX_V, BOX_F, epsilon=.1)
        colliders = m.colliders(fit="contain", density=3)
        self.assertTrue(colliders.report["proved"])
        self.assertAlmostEqual(colliders.mass, 6)
        np.testing.assert_allclose(colliders.centre, [1, .5, .5])
        np.testing.assert_allclose(colliders.inertia, np.diag([1, 2.5, 2.5]), atol=1e-9)
        self.assertEqual(len(colliders.hulls), len(colliders.shapes))
        held = np.zeros(len(BOX_V), bool)
        for points, triangles in colliders.hulls:
            a, b, c = points[triangles].swapaxes(0, 1)
            normal = np.cross(b - a, c - a)
            held |= (np.einsum("fk,vfk->vf", normal, BOX_V[:, None] - a) <= 1e-9).all(1)
        self.assertTrue(held.all())
        only = m.colliders(kind="spheres", dent=.2)
        self.assertTrue(len(only.shapes) and (only.shapes == only.shapes[:, :1]).all())

    def test_an_envelope_is_a_mesh_at_distance_zero(self):
        m = qmat.mat(BOX_V, BOX_F, epsilon=.05)
        self.assertLess(abs(m.error_at(m.envelope().vertices)).max(), .02)

    def test_vertices_stop_within_an_epsilon_of_any_kind(self):
        coarse = {"samples.spacing": "30%"}
        for given in ({"epsilon": .1, "set": coarse}, {"set": {"epsilon": "10%", **coarse}}):
            m = qmat.mat(BOX_V, BOX_F, vertices=9, **given)
            self.assertEqual((len(m.spheres), m.errors.epsilon), (9, .1 * m.errors.diagonal))
        self.assertEqual(qmat.mat(BOX_V, BOX_F, vertices=9, set=coarse).errors.epsilon, 0)

    def test_vertices_and_features_are_inputs(self):
        coarse = {"samples.spacing": "30%"}
        self.assertEqual(len(qmat.mat(BOX_V, BOX_F, epsilon=.1, vertices=9, set=coarse).spheres), 9)
        sharp = qmat.mat(BOX_V, BOX_F, epsilon=.1, features="sharp", set=coarse)
        self.assertEqual(np.count_nonzero(sharp.radii == 0), 8)


class OfFiles(InAFolder):
    def test_the_files_are_those_of_the_program(self):
        write_off("box.off", BOX_V, BOX_F)
        subprocess.run([program, "mat", "box.off", "-o", "right.glb", "-o", "right.ma", "--epsilon", "3%", "--set",
                        "asset.flat=none", "--no-cache", "-q"], check=True, capture_output=True)
        m = qmat.mat("box.off", epsilon="3%", set={"asset.flat": "none"})
        m.save("made.glb", Path("made.ma"), "made.svg")
        self.assertIn("<svg", Path("made.svg").read_text())
        for ending in ("glb", "ma"):
            self.assertEqual(Path(f"made.{ending}").read_bytes(), Path(f"right.{ending}").read_bytes())
        self.assertEqual(m.report["nodes"][0]["id"], "model")

    def test_a_graph_file_gives_values_and_files(self):
        write_off("box.off", BOX_V, BOX_F)
        Path("mine.yaml").write_text((source / "graphs" / "qmat_plus.yaml").read_text())
        graph = qmat.Graph("mine.yaml").set({"asset.format": "ma"}, model=Path("box.off"), epsilon=.05)
        self.assertIn("epsilon", graph.inputs)
        self.assertEqual(graph.outputs["asset"], "asset.file")
        self.assertEqual(graph.ports["thickness.thickness"], "field")
        found = graph.run("asset", "samples.samples", "thickness.thickness", "errors.report", save="saved.ma")
        self.assertEqual((found["asset"].format, found["asset"].bytes), ("ma", Path("saved.ma").read_bytes()))
        self.assertEqual(found["thickness.thickness"].arrays["values"].shape, (12,))
        samples = found["samples.samples"]
        np.testing.assert_allclose(samples.arrays["barycentrics"].sum(1), 1)
        self.assertEqual((samples.type, samples.arrays["facets"].dtype), ("samples", np.uint32))
        self.assertEqual(set(found), {"asset", "samples.samples", "thickness.thickness", "errors.report"})
        # Without names: the outputs. A file of an earlier run is not written again.
        os.remove("saved.ma")
        self.assertEqual(list(graph.run()), ["asset"])
        self.assertFalse(os.path.exists("saved.ma"))

    def test_a_run_without_names_saves_what_has_a_path_in_the_graph(self):
        write_off("box.off", BOX_V, BOX_F)
        Path("own.yaml").write_text("qmat: 1\nnodes:\n  model: { type: scene.read, params: { path: box.off } }\n"
                                    "  solid: { type: mesh.solid, in: { mesh: model.mesh } }\n"
                                    "outputs: { mesh: solid.mesh, report: { from: solid.report, path: own/report.json } }\n")
        graph, report = qmat.Graph("own.yaml"), Path("own/report.json")
        graph.run("report")
        self.assertFalse(report.parent.exists())
        found = graph.run()
        self.assertEqual(list(found), ["mesh", "report"])
        self.assertEqual(json.loads(report.read_text()).keys(), found["report"].keys())
        report.unlink()
        found = graph.run(save={"report": "new/folder/report.json"})
        self.assertEqual((len(found), report.exists()), (0, False))
        self.assertTrue(Path("new/folder/report.json").exists())

    def test_folders_are_made(self):
        m = qmat.mat(BOX_V, BOX_F, epsilon=.1)
        m.save("new/folder/box.ma", "other/box.glb")
        self.assertTrue(Path("new/folder/box.ma").exists() and Path("other/box.glb").exists())

    def test_a_graph_file_and_its_paths_are_found_from_any_folder(self):
        os.mkdir("sub")
        write_off("sub/box.off", BOX_V, BOX_F)
        Path("sub/mine.yaml").write_text("qmat: 1\nnodes: { model: { type: scene.read, params: { path: box.off } } }\n"
                                         "outputs: { mesh: model.mesh }\n")
        graph, here = qmat.Graph("sub/mine.yaml"), os.getcwd()
        for folder in ("/", here, "/"):
            os.chdir(folder)
            np.testing.assert_array_equal(graph.run()["mesh"].vertices, BOX_V)

    def test_a_scene_is_a_list_with_names_and_failures(self):
        write_gltf("scene.gltf", {"box": (BOX_V, BOX_F), "none": (BOX_V, np.array([[0, 0, 1]])),
                                  "long": (BOX_V * [4, 1, 1], BOX_F)})
        graph = qmat.Graph().set({"model.defects": "drop"}, model="scene.gltf", epsilon=.05)
        found = graph.run("simple.medial", "solid.mesh", "errors.report")
        medials = found["simple.medial"]
        # The list is a value, too.
        skins = qmat.Graph(text=OF_SPHERES).give("given.medial", medials).run()["skin"]
        self.assertEqual([type(skin) for skin in skins], [qmat.Mesh, qmat.Error, qmat.Mesh])
        self.assertIsInstance(medials.pop(1), qmat.Error)
        self.assertEqual([medial.name for medial in medials], ["box", "long"])
        np.testing.assert_array_equal(medials[0].spheres, qmat.mat(BOX_V, BOX_F, epsilon=.05).spheres)
        self.assertTrue(all(found["errors.report"][i]["certified"] for i in (0, 2)))
        # An item is a value like any other.
        skin = qmat.Graph(text=OF_SPHERES).give("given.medial", medials[1]).run()["skin"]
        self.assertAlmostEqual(skin.vertices[:, 0].max(), 8, delta=.5)

        with self.assertRaises(qmat.UsageError) as raised:
            qmat.mat("scene.gltf", epsilon=.05, set={"model.defects": "drop"})
        self.assertIn("merged", raised.exception.hint)
        self.assertIn('set={"model.mesh": "merged"}', str(raised.exception))

        # An item may be named; the only value of a port is its item 0.
        np.testing.assert_array_equal(found["simple.medial[0]"].spheres, medials[0].spheres)
        self.assertAlmostEqual(qmat.Graph(text=OF_SPHERES).give("given.medial", medials[1]).run()["skin[0]"]
                               .vertices[:, 0].max(), 8, delta=.5)

    def test_a_second_run_is_from_the_cache(self):
        for hits in (False, True):
            m = qmat.mat(BOX_V, BOX_F, epsilon=.05, cache="cache")
            self.assertEqual({node["cache"] == "hit" for node in m.report["nodes"]}, {hits})
        self.assertTrue(os.listdir("cache"))

    def test_a_graph_has_the_mesh_that_was_given_last_as_it_was_then(self):
        V, graph = BOX_V.copy(), qmat.Graph().set(epsilon=.05)
        graph.give("model.mesh", V * 3, BOX_F).run("solid.mesh")
        graph.give("model.mesh", V, BOX_F)
        V *= 5
        for _ in range(2):
            self.assertEqual(graph.run("solid.mesh")["solid.mesh"].vertices.max(), BOX_V.max())


class Mistakes(InAFolder):
    def test_errors_have_the_line_of_the_program_and_its_parts(self):
        with self.assertRaises(qmat.UsageError) as raised:
            qmat.mat(BOX_V, BOX_F, set={"simple.epsilom": 1})
        self.assertIsInstance(raised.exception, ValueError)
        self.assertIn("epsilon", raised.exception.hint)
        Path("bad.yaml").write_text("qmat: 1\nnodes:\n  a: { type: mesh.sfd }\n")
        with self.assertRaises(qmat.UsageError) as raised:
            qmat.Graph("bad.yaml")
        said = subprocess.run([program, "check", "bad.yaml"], capture_output=True, text=True).stderr
        self.assertIn(str(raised.exception), said)
        self.assertEqual((raised.exception.line, raised.exception.file), (3, "bad.yaml"))
        self.assertEqual(qmat.Graph("qmat_plus").ports, qmat.Graph().ports)
        self.assertIn("colliders.colliders", qmat.Graph("colliders").ports)
        with self.assertRaises(qmat.Error):
            qmat.Graph("qmat_plu")
        with self.assertRaises(qmat.Error) as raised:
            qmat.mat("nowhere.off")
        self.assertEqual((raised.exception.status, raised.exception.node), ("io", "model"))
        with self.assertRaises(qmat.Error) as raised:
            qmat.mat(BOX_V, np.vstack([BOX_F, [[0, 1, 8]]]))
        self.assertEqual((raised.exception.element_kind, raised.exception.element), ("facet", 12))
        with self.assertRaises(qmat.Error) as raised:
            qmat.mat(np.where(BOX_V == 2, np.nan, BOX_V), BOX_F)
        self.assertEqual((raised.exception.element_kind, raised.exception.element), ("vertex", 1))

    def test_a_text_with_a_nul_reaches_nothing(self):
        write_off("box.off", BOX_V, BOX_F)
        graph = qmat.Graph().set(model="box.off", epsilon=.1)
        for call in (lambda: qmat.mat("box.off\0x"), lambda: qmat.Graph("qmat_plus\0x"), lambda: qmat.Graph(cache=b"c\0x"),
                     lambda: graph.set(epsilon="5%\0x"), lambda: graph.set({"epsilon=.2\0": 1}),
                     lambda: graph.give("model.mesh\0x", BOX_V, BOX_F),
                     lambda: graph.give("model.mesh", BOX_V, BOX_F, name="box\0x"), lambda: graph.run("solid.mesh\0x"),
                     lambda: graph.run(save="a.ma\0x"), lambda: graph.run(save={"asset\0x": Path("a.ma")}),
                     lambda: graph.run("solid.mesh")["solid.mesh[0]\0x"]):
            with self.assertRaisesRegex(ValueError, "^embedded null byte$"):
                call()
        with self.assertRaises(ValueError):
            qmat.Graph(text="qmat: 1\0\nnodes: {}")
        self.assertEqual(os.listdir(), ["box.off"])
        self.assertEqual(graph.run("errors.report")["errors.report"]["epsilon"], .1)

    def test_errors_survive_copies_and_pickles(self):
        for wrong in (lambda: qmat.mat(BOX_V, np.vstack([BOX_F, [[0, 1, 8]]])), lambda: qmat.Graph(text="qmat: 1\nnodes: 3"),
                      lambda: qmat.mat(BOX_V, BOX_F, progress=lambda *call: False)):
            with self.assertRaises(qmat.Error) as raised:
                wrong()
            error = raised.exception
            for other in (pickle.loads(pickle.dumps(error)), copy.copy(error)):
                self.assertEqual((type(other), str(other), vars(other)), (type(error), str(error), vars(error)))
                self.assertEqual(len(vars(other)), 11)

    def test_arrays_have_no_unit_and_no_model_to_set(self):
        for name, value in (("model.unit", "mm"), ("model.mesh", "merged"), ("model", "box.off")):
            with self.assertRaises(qmat.UsageError) as raised:
                qmat.mat(BOX_V, BOX_F, set={name: value})
            self.assertEqual((raised.exception.node, raised.exception.status), ("model", "usage"))
            self.assertIn(f"'{name}'", str(raised.exception))

    def test_arrays_of_another_kind_are_refused_before_they_reach_the_library(self):
        for V, F, error in ((BOX_V[:, :2], BOX_F, ValueError), (BOX_V, BOX_F.astype(float), TypeError),
                            (BOX_V, -BOX_F, ValueError), (BOX_V, BOX_F + 2 ** 32, ValueError),
                            (BOX_V.astype(complex), BOX_F, TypeError), (BOX_V, None, TypeError)):
            with self.assertRaises(error):
                qmat.mat(V, F)
        graph = qmat.Graph("qmat_plus")
        with self.assertRaises(TypeError):
            graph.give("model.mesh", BOX_V)
        with self.assertRaises(qmat.UsageError):
            graph.give("simple.medal", [[0, 0, 0, 1]], [])
        with self.assertRaises(qmat.UsageError):
            graph.give("samples.samples", BOX_V, BOX_F)
        medial = qmat.Graph(text=OF_SPHERES).give("given.medial", [[0, 0, 0, 1]]).run("given.medial")["given.medial"]
        with self.assertRaises(qmat.UsageError):
            graph.give("model.mesh", medial)
        with self.assertRaises(qmat.Error) as raised:
            medial.error_at([[0, 0, 0], [0, np.inf, 0]])
        self.assertEqual(raised.exception.element, 1)
        self.assertEqual(medial.error_at(np.empty((0, 3))).shape, (0,))
        with self.assertRaises(qmat.Error):
            qmat.Graph(text=OF_SPHERES).give("given.medial", [[0, 0, 0, 1]], [[0, 1]])

    def test_a_graph_goes_on_after_a_mistake(self):
        graph = qmat.Graph().give("model.mesh", BOX_V, BOX_F).set(epsilon=.05)
        with self.assertRaises(qmat.UsageError):
            graph.run("simple.nothing")
        with self.assertRaises(qmat.UsageError):
            graph.run(save="box.doc")
        with self.assertRaises(qmat.UsageError):
            graph.set(epsilon="much")
        self.assertTrue(len(graph.run("simple.medial")["simple.medial"].spheres))

    def test_a_graph_keeps_its_settings_when_they_cannot_be_repeated(self):
        graph = qmat.Graph(cache="cache").give("model.mesh", BOX_V, BOX_F).set(epsilon=.05)
        right = graph.run("simple.medial")["simple.medial"].spheres
        shutil.rmtree("cache")
        Path("cache").touch()
        for _ in range(2):
            with self.assertRaises(qmat.UsageError) as raised:
                graph.run("simple.medial")
            self.assertIn("cache", str(raised.exception))
        os.remove("cache")
        np.testing.assert_array_equal(graph.run("simple.medial")["simple.medial"].spheres, right)


class Forks(unittest.TestCase):
    def test_a_forked_child_runs_and_reads_results_of_its_parent(self):
        m = qmat.mat(BOX_V, BOX_F, epsilon=.05, threads=2)

        def work():
            m.error_at(BOX_V)
            np.testing.assert_array_equal(qmat.mat(BOX_V, BOX_F, epsilon=.05, threads=2).spheres, m.spheres)

        child = multiprocessing.get_context("fork").Process(target=work)
        child.start()
        child.join(60)
        child.kill()
        child.join()
        self.assertEqual(child.exitcode, 0)


class AtTheEnd(InAFolder):
    def test_results_and_threads_of_libraries_may_outlive_the_module(self):
        write_off("ball.off", *ball(12))
        for _ in range(2):
            self.assertEqual(subprocess.run([sys.executable, "-c", "import qmat\nm = qmat.mat('ball.off', epsilon=.05)\n"
                                             "c = m.colliders(kind='capsules')"]).returncode, 0)


class Progress(unittest.TestCase):
    def setUp(self):
        self.V, self.F = ball(48)  # seconds of work

    def test_it_names_the_nodes_in_their_order(self):
        calls = []
        qmat.mat(BOX_V, BOX_F, epsilon=.05, progress=lambda *call: calls.append(call))
        named = list(dict.fromkeys(call[0] for call in calls))
        self.assertIn("simple", named)
        self.assertLess(named.index("initial"), named.index("simple"))
        self.assertTrue(all(done <= total or not total for _, done, total, _ in calls))

    def test_false_and_exceptions_cancel(self):
        for false in (False, np.False_, 0):
            with self.assertRaises(qmat.Cancelled):
                qmat.mat(self.V, self.F, progress=lambda *call: false if call[0] == "initial" else None)

        class Enough(Exception):
            pass

        def refuse(*call):
            raise Enough

        with self.assertRaises(Enough):
            qmat.mat(self.V, self.F, progress=refuse)

    def test_an_interrupt_cancels_and_the_graph_runs_again(self):
        graph = qmat.Graph().give("model.mesh", self.V, self.F).set(epsilon=.05)
        started = []

        def interrupt():
            started.append(time.monotonic())
            os.kill(os.getpid(), signal.SIGINT)

        timer = threading.Timer(.3, interrupt)
        timer.start()
        with self.assertRaises(KeyboardInterrupt):
            graph.run("simple.medial")
            time.sleep(60)  # the machine was too fast: the interrupt comes here
        self.assertLess(time.monotonic() - started[0], 5)
        timer.join()
        graph.give("model.mesh", BOX_V, BOX_F)
        self.assertTrue(len(graph.run("simple.medial")["simple.medial"].spheres))

    def test_threads_run_graphs_at_the_same_time(self):
        coarse = {"samples.spacing": "10%"}
        right, found = qmat.mat(BOX_V, BOX_F, epsilon=.05, set=coarse).spheres, {}

        def work(i):
            found[i] = qmat.mat(BOX_V, BOX_F, epsilon=.05, threads=1, set=coarse).spheres

        threads = [threading.Thread(target=work, args=(i,)) for i in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for i in range(4):
            np.testing.assert_array_equal(found[i], right)


if __name__ == "__main__":
    unittest.main(verbosity=2)
