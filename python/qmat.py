# SPDX-License-Identifier: GPL-3.0-or-later
"""qmat: the medial axis transform of 3D models, with numpy arrays.

    import qmat
    m = qmat.mat(V, F, epsilon=.01)        # or qmat.mat("octopus.off", epsilon=.01)
    m.spheres, m.cones, m.slabs            # (n, 4) x y z radius; (n, 2) and (n, 3) indices of spheres
    m.errors.surface_to_envelope           # proved bounds, in the units of the model
    m.error_at(V)                          # signed distance of points to the envelope
    m.colliders(fit="contain")             # shapes for physics, with mass and inertia
    m.save("octopus.glb")

Graph runs any graph, with meshes and medial meshes in memory as values. Ctrl-C cancels a run. Errors are qmat.Error,
whose text is the line that the program prints. Different threads may use different graphs at the same time.
"""
import functools
import json
import os
from collections import namedtuple
from collections.abc import Mapping
from pathlib import Path

import cffi
import numpy as np

__all__ = ["mat", "Graph", "Mesh", "Medial", "MedialMesh", "Colliders", "Errors", "Value", "File", "Report", "Items", "Results",
           "Error", "UsageError", "Cancelled", "nodes", "version"]

# The declarations of qmat.h; a test compares the two.
_DECLARATIONS = """
typedef enum qmat_result {
  QMAT_RESULT_OK = 0,
  QMAT_RESULT_FAILED = 1,
  QMAT_RESULT_USAGE = 2,
  QMAT_RESULT_CANCELLED = 3
} qmat_result;
typedef struct qmat_job qmat_job;
const char *qmat_version(void);
char *qmat_nodes_json(void);
void qmat_text_free(char *text);
qmat_result qmat_job_new(qmat_job **job);
qmat_result qmat_job_new_from_file(qmat_job **job, const char *path);
qmat_result qmat_job_new_from_text(qmat_job **job, const char *text, size_t size);
void qmat_job_free(qmat_job *job);
qmat_result qmat_job_set(qmat_job *job, const char *assignment);
qmat_result qmat_job_give_mesh(qmat_job *job, const char *port, const char *name, const double *positions,
                               size_t vertex_count, const uint32_t *triangles, size_t triangle_count);
qmat_result qmat_job_give_medial(qmat_job *job, const char *port, const double *spheres, size_t sphere_count,
                                 const uint32_t *edges, size_t edge_count, const uint32_t *triangles,
                                 size_t triangle_count);
qmat_result qmat_job_give_result(qmat_job *job, const char *port, const qmat_job *from, const char *from_port);
qmat_result qmat_job_want(qmat_job *job, const char *port);
qmat_result qmat_job_graph(qmat_job *job, char **json);
qmat_result qmat_job_save(qmat_job *job, const char *output, const char *path);
void qmat_job_forget(qmat_job *job);
qmat_result qmat_job_cache(qmat_job *job, const char *folder);
char *qmat_cache_folder(void);
qmat_result qmat_job_hits(qmat_job *job, size_t *hits, size_t *nodes);
typedef bool (*qmat_job_progress)(void *user, const char *node, const char *type, uint64_t done, uint64_t total,
                                  const char *unit);
qmat_result qmat_job_run(qmat_job *job, int threads, qmat_job_progress progress, void *user);
typedef struct qmat_value_view {
  const char *type;
  const char *name;
  size_t item_count;
  size_t array_count;
} qmat_value_view;
typedef struct qmat_array_view {
  const char *name;
  size_t rows, columns;
  const double *numbers;
  const uint32_t *ids;
} qmat_array_view;
qmat_result qmat_job_value(qmat_job *job, const char *port, qmat_value_view *view);
qmat_result qmat_job_array(qmat_job *job, const char *port, size_t array, qmat_array_view *view);
typedef struct qmat_medial_view {
  size_t sphere_count, edge_count, triangle_count;
  const double *spheres;
  const uint32_t *edges;
  const uint32_t *triangles;
} qmat_medial_view;
typedef struct qmat_mesh_view {
  size_t vertex_count, triangle_count;
  const double *positions;
  const uint32_t *triangles;
} qmat_mesh_view;
typedef struct qmat_file_view {
  const char *format;
  size_t part_count;
} qmat_file_view;
qmat_result qmat_job_medial(qmat_job *job, const char *port, qmat_medial_view *view);
qmat_result qmat_job_mesh(qmat_job *job, const char *port, qmat_mesh_view *view);
qmat_result qmat_job_file(qmat_job *job, const char *port, qmat_file_view *view);
qmat_result qmat_job_file_part(qmat_job *job, const char *port, size_t part, const char **name, const uint8_t **bytes,
                               size_t *size);
qmat_result qmat_job_distances(qmat_job *job, const char *port, const double *points, size_t count,
                               double *distances);
qmat_result qmat_job_report(qmat_job *job, const char *port, char **json);
qmat_result qmat_job_run_report(qmat_job *job, char **json);
typedef struct qmat_job_problem {
  qmat_result result;
  const char *status;
  const char *node;
  const char *type;
  const char *field;
  const char *element_kind;
  int64_t element;
  const char *file;
  int line, column;
  const char *message, *hint;
  const char *text;
} qmat_job_problem;
const qmat_job_problem *qmat_job_error(const qmat_job *job);
"""

_ffi = cffi.FFI()
_ffi.cdef(_DECLARATIONS)
_ffi.cdef("void omp_set_max_active_levels(int levels);")  # of OpenMP, which the library uses


def _open():
    """$QMAT_LIBRARY; else the library of the installation that this file is in; else the system's."""
    name = "libqmat.so.0"
    here = Path(__file__).resolve()
    beside = [folder / name for folder in list(here.parents)[1:4]]  # PREFIX/lib/pythonX/site-packages/qmat.py
    named = os.environ.get("QMAT_LIBRARY")
    path = named or next((str(path) for path in beside if path.exists()), name)
    # Never unloaded: results are freed, and its threads end, when Python does.
    return _ffi.dlopen(path, os.RTLD_NOW | os.RTLD_NODELETE)


_lib = _open()


def _text(pointer):
    return _ffi.string(pointer).decode("utf-8", "replace")


def _bytes(text, encode=str.encode):
    """The text for a call of the library, which would take a NUL for its end. Paths: os.fsencode."""
    encoded = encode(text)
    if b"\0" in encoded:
        raise ValueError("embedded null byte")
    return encoded


def _json(pointer):
    """The object of a JSON text that the library made, which is freed."""
    if not pointer:
        raise MemoryError
    try:
        return json.loads(_text(pointer))
    finally:
        _lib.qmat_text_free(pointer)


version = __version__ = _text(_lib.qmat_version())


def nodes():
    """All node types with their ports and parameters, as `qmat nodes --json` prints them."""
    return _json(_lib.qmat_nodes_json())


class Error(Exception):
    """What went wrong, as the line that the program prints. Its parts are attributes; "", -1 and 0 do not apply."""

    status = node = type = field = element_kind = file = message = hint = ""
    element, line, column = -1, 0, 0

    def __init__(self, text, **parts):
        super().__init__(text)
        vars(self).update(parts)


class UsageError(Error, ValueError):
    """A wrong graph, name or value."""


class Cancelled(Error):
    """The progress function said so."""


_ERRORS = {_lib.QMAT_RESULT_USAGE: UsageError, _lib.QMAT_RESULT_CANCELLED: Cancelled}


def _error(problem):
    parts = {name: _text(getattr(problem, name)) for name in
             ("status", "node", "type", "field", "element_kind", "file", "message", "hint")}
    numbers = {name: getattr(problem, name) for name in ("element", "line", "column")}
    return _ERRORS.get(problem.result, Error)(_text(problem.text), **parts, **numbers)


@functools.cache
def _prepare_forks():
    """A forked child lacks the threads of its parent, for which OpenMP would wait: there, it uses one."""
    os.register_at_fork(after_in_child=lambda: _lib.omp_set_max_active_levels(0))


class _Job:
    """A job of the library, which it frees."""

    def __init__(self, make, *arguments):
        place = _ffi.new("qmat_job **")
        result = make(place, *arguments)
        self.job = _ffi.gc(place[0], _lib.qmat_job_free) if place[0] else _ffi.NULL
        self.check(result)

    def check(self, result):
        if result != _lib.QMAT_RESULT_OK:
            raise _error(_lib.qmat_job_error(self.job))

    def call(self, function, *arguments):
        self.check(function(self.job, *arguments))

    def json(self, function, *arguments):
        place = _ffi.new("char **")
        self.call(function, *arguments, place)
        return _json(place[0])

    def run(self, threads, progress):
        """Runs it. A cancelled run raises what cancelled it: an exception of `progress`, or Ctrl-C."""
        raised = []

        def caught(kind, exception, trace):
            raised.append(exception)  # Ctrl-C between two lines of `step`, too

        def step(user, node, type, done, total, unit):
            if raised:
                return False
            answer = progress(_text(node), done, total, _text(unit)) if progress else None
            return answer is None or bool(answer)

        signature = "bool(void *, const char *, const char *, uint64_t, uint64_t, const char *)"
        callback = _ffi.callback(signature, step, error=False, onerror=caught)
        _prepare_forks()
        result = _lib.qmat_job_run(self.job, threads, callback, _ffi.NULL)
        if raised:
            raise raised[0]
        self.check(result)

    def value(self, port):
        view = _ffi.new("qmat_value_view *")
        self.call(_lib.qmat_job_value, _bytes(port), view)
        return view

    def arrays(self, port, count):
        """Copies of the tables of numbers of a value, by name."""
        found, view = {}, _ffi.new("qmat_array_view *")
        for i in range(count):
            self.call(_lib.qmat_job_array, _bytes(port), i, view)
            pointer, kind = (view.numbers, np.float64) if view.numbers else (view.ids, np.uint32)
            size = view.rows * view.columns
            flat = np.empty(0, kind)
            if size:
                flat = np.frombuffer(_ffi.buffer(pointer, size * kind().itemsize), kind).copy()
            found[_text(view.name)] = flat if view.columns == 1 else flat.reshape(-1, view.columns)
        return found

    def file(self, port):
        view = _ffi.new("qmat_file_view *")
        self.call(_lib.qmat_job_file, _bytes(port), view)
        name, data, size = _ffi.new("const char **"), _ffi.new("const uint8_t **"), _ffi.new("size_t *")
        parts = {}
        for i in range(view.part_count):
            self.call(_lib.qmat_job_file_part, _bytes(port), i, name, data, size)
            parts[_text(name[0])] = bytes(_ffi.buffer(data[0], size[0]))
        return _text(view.format), parts


# ---- values ----


def _table(array, columns, kind, what):
    """The array as a C-contiguous table of that many columns, which must be exact: a copy only where it differs."""
    given = np.asarray(array)
    if given.size == 0:
        given = np.empty((0, columns), kind)
    if given.ndim != 2 or given.shape[1] != columns:
        raise ValueError(f"{what}: an array of shape {given.shape}, not (n, {columns})")
    if kind is np.uint32:
        if given.dtype.kind not in "iu":
            raise TypeError(f"{what}: indices have to be integers, not {given.dtype}")
        if given.size and (given.min() < 0 or given.max() > 0xFFFFFFFF):
            raise ValueError(f"{what}: an index is negative or too large")
    elif given.dtype.kind not in "iuf":
        raise TypeError(f"{what}: numbers have to be real, not {given.dtype}")
    return np.ascontiguousarray(given, kind)


def _own_table(array, columns, kind, what):
    """The same, but never the caller's array, which may change before a later run."""
    return _table(array, columns, kind, what).copy()


def _pointer(array):
    kind = "double *" if array.dtype == np.float64 else "uint32_t *"
    return _ffi.cast(kind, array.ctypes.data)


class Value:
    """A result of a run: its type ("samples"), the name of its mesh in a scene (""), and its arrays by name."""

    def __init__(self, job, port, type, name, arrays):
        self._job, self._port, self.type, self.name, self.arrays = job, port, type, name, arrays

    def __repr__(self):
        sizes = ", ".join(f"{name} {array.shape}" for name, array in self.arrays.items() if array.size)
        return f"<qmat {self.type}{' ' + self.name if self.name else ''}: {sizes}>"


class Mesh(Value):
    """A triangle mesh: vertices (n, 3) and triangles (m, 3)."""

    vertices = property(lambda self: self.arrays["positions"])
    triangles = property(lambda self: self.arrays["triangles"])


class Medial(Value):
    """A medial mesh: spheres (n, 4) x y z radius; cones (m, 2) and slabs (k, 3), indices of spheres. The sides of slabs
    are among the cones."""

    spheres = property(lambda self: self.arrays["spheres"])
    centres = property(lambda self: self.spheres[:, :3])
    radii = property(lambda self: self.spheres[:, 3])
    cones = property(lambda self: self.arrays["edges"])
    slabs = property(lambda self: self.arrays["triangles"])

    def error_at(self, points):
        """Signed distances of points (n, 3) to the envelope. At a point of the surface this is the error there: positive
        where the envelope lacks volume, negative where it has too much. Inside, the depth is at least as large."""
        points = _table(points, 3, np.float64, "points")
        distances = np.empty(len(points))
        self._job.call(_lib.qmat_job_distances, _bytes(self._port), _pointer(points), len(points), _pointer(distances))
        return distances


class Colliders(Value):
    """Shapes for collision detection: spheres (n, 4), and shapes (m, 3) of indices, whose convex hulls they are. A
    capsule repeats its second index, a sphere its first. `report` has the measures; it is None in results of a graph."""

    report = None
    spheres = property(lambda self: self.arrays["spheres"])
    shapes = property(lambda self: self.arrays["shapes"])
    joints = property(lambda self: self.arrays["joints"], doc="The joint that moves each shape; empty without a skin.")

    @property
    def hulls(self):
        """A polyhedron for each shape: vertices (n, 3) and triangles (m, 3)."""
        ends = np.vstack([np.zeros((1, 2), int), self.arrays["hull_ends"].astype(int)])
        return [(self.arrays["points"][a:b], self.arrays["triangles"][c:d] - np.uint32(a))
                for (a, c), (b, d) in zip(ends[:-1], ends[1:])]

    def _of_body(self, *places):
        body = self.arrays["body"]
        return body[0, list(places)] if len(body) else None

    @property
    def mass(self):
        """The mass of the solid in kg; None for an open surface, as the next two."""
        body = self.arrays["body"]
        return float(body[0, 0]) if len(body) else None

    centre = property(lambda self: self._of_body(1, 2, 3))

    @property
    def inertia(self):
        """The inertia tensor about the centre of mass (3, 3)."""
        tensor = self._of_body(4, 7, 8, 7, 5, 9, 8, 9, 6)
        return None if tensor is None else tensor.reshape(3, 3)


class File(Value):
    """A file in memory: its format, its bytes, and its side files by name."""

    def __init__(self, job, port, name):
        super().__init__(job, port, "file", name, {})
        self.format, parts = job.file(port)
        self.bytes = parts.pop("")
        self.parts = parts


class Report(dict):
    """A report: counts and errors by name, in shares of the diagonal."""

    def __init__(self, job, port):
        super().__init__(job.json(_lib.qmat_job_report, _bytes(port)))
        self._job, self._port = job, port


class Items(list):
    """The values of a scene with several meshes, one for each; one that could not be made is an exception."""

    def __init__(self, job, port, count):
        super().__init__()
        self._job, self._port = job, port
        for i in range(count):
            try:
                self.append(_value(job, f"{port}[{i}]"))
            except Error as error:
                self.append(error)


_CLASSES = {"mesh": Mesh, "medial": Medial, "colliders": Colliders}


def _value(job, port):
    """The value of a port."""
    view = job.value(port)
    kind, name = _text(view.type), _text(view.name)
    if view.item_count:
        return Items(job, port, view.item_count)
    if kind == "report":
        return Report(job, port)
    if kind == "file":
        return File(job, port, name)
    return _CLASSES.get(kind, Value)(job, port, kind, name, job.arrays(port, view.array_count))


class Results(Mapping):
    """The results of a run by port ("simple.medial") or output ("asset"): `report` is that of the whole run. A list has
    items ("simple.medial[1]"); a single value is its own item 0."""

    def __init__(self, job, ports):
        self._job, self._ports, self._values = job, ports, {}

    def __getitem__(self, name):
        if name not in self._values:
            whole, bracket, item = name.partition("[") if isinstance(name, str) else (name, "", "")
            self._values[name] = _value(self._job, self._ports[whole] + bracket + item)
        return self._values[name]

    def __iter__(self):
        return iter(self._ports)

    def __len__(self):
        return len(self._ports)

    @property
    def report(self):
        return self._job.json(_lib.qmat_job_run_report)


# ---- graphs ----


def _assignment(name, value):
    if isinstance(value, (bool, np.bool_)):
        value = "true" if value else "false"
    elif isinstance(value, (float, np.floating)):
        value = repr(float(value))
    value = value if isinstance(value, (str, bytes, os.PathLike)) else str(value)
    return _bytes(f"{name}=", os.fsencode) + _bytes(value, os.fsencode)


class Graph:
    """A graph of nodes: a file, the name of a built-in graph ("qmat_plus", "colliders", "lod"), or a text.

    Without any of them it is qmat_plus, the graph of `qmat mat`.

    A graph may be run many times; results stay as they are when the graph is changed or run again. Each run reads the
    file again, so it has to stay where it is.
    `cache`: a folder, or True for that of the command line. Without it nothing is stored.
    """

    def __init__(self, path=None, text=None, cache=None):
        if path is not None and text is not None:
            raise TypeError("a graph is a path or a text, not both")
        if path is not None:
            self._make = (_lib.qmat_job_new_from_file, _bytes(path, os.fsencode))
        elif text is not None:
            self._make = (_lib.qmat_job_new_from_text, text.encode(), len(text.encode()))
        else:
            self._make = (_lib.qmat_job_new,)
        self._calls = {}  # by what each one sets: function, arguments, what has to stay alive
        self._job = _Job(*self._make)
        described = self._job.json(_lib.qmat_job_graph)
        if path is not None and os.path.exists(path):  # runs find it and what it names from any working folder
            self._make = (_lib.qmat_job_new_from_file, os.path.join(os.getcwdb(), self._make[1]))
            self._job = None
        self.inputs = described["inputs"]
        self.outputs = {output["name"]: output["port"] for output in described["outputs"]}
        self._made = [output["name"] for output in described["outputs"] if not output["on_request"]]
        self.ports = {f"{node['id']}.{port}": kind for node in described["nodes"]
                      for port, kind in node["outputs"].items()}
        if cache is True:
            folder = _lib.qmat_cache_folder()
            cache = _ffi.string(folder) if folder else None
            _lib.qmat_text_free(folder)
        if cache:
            self._call("cache", _lib.qmat_job_cache, _bytes(cache, os.fsencode))

    def _current(self):
        """The job of the next run."""
        if not self._job:
            job = _Job(*self._make)
            for function, arguments, _ in self._calls.values():
                job.call(function, *arguments)
            self._job = job
        return self._job

    def _call(self, what, function, *arguments, alive=None):
        """Calls the library, and again for each later run, until another call sets the same."""
        self._current().call(function, *arguments)
        self._calls.pop(what, None)  # calls have an order: an input may set what a parameter sets, too
        self._calls[what] = (function, arguments, alive)

    def set(self, settings=(), **inputs):
        """Sets parameters: g.set({"simple.protect": "late"}, epsilon=.01, model="octopus.off"). Returns the graph."""
        for name, value in {**dict(settings), **inputs}.items():
            self._call(("set", name), _lib.qmat_job_set, _assignment(name, value))
        return self

    def give(self, port, value, *more, name=None):
        """Gives the value of an output port, whose node then does not run: a result of any run, also that of a scene
        with several meshes, or arrays V, F of a mesh, or spheres, cones, slabs of a medial mesh. `name` is that of the mesh.
        Returns the graph."""
        place, what = _bytes(port), ("give", port)
        if isinstance(value, (Value, Report, Items)):
            self._call(what, _lib.qmat_job_give_result, place, value._job.job, _bytes(value._port), alive=value)
        elif port not in self.ports:
            self._current().call(_lib.qmat_job_want, place)  # says which port is meant
        elif self.ports[port] == "medial":
            spheres = _own_table(value, 4, np.float64, "spheres")
            cones, slabs = [_own_table(more[i] if len(more) > i else [], 2 + i, np.uint32, ("cones", "slabs")[i])
                            for i in range(2)]
            self._call(what, _lib.qmat_job_give_medial, place, _pointer(spheres), len(spheres), _pointer(cones), len(cones),
                       _pointer(slabs), len(slabs), alive=(spheres, cones, slabs))
        else:
            if len(more) != 1:
                raise TypeError(f"{port}: a mesh is given as two arrays, V and F")
            positions = _own_table(value, 3, np.float64, "V")
            triangles = _own_table(more[0], 3, np.uint32, "F")
            title = _bytes(name) if name else _ffi.NULL
            self._call(what, _lib.qmat_job_give_mesh, place, title, _pointer(positions), len(positions), _pointer(triangles),
                       len(triangles), alive=(positions, triangles, title))
        return self

    def run(self, *want, save=None, threads=0, progress=None):
        """Runs what these ports or outputs need; without any, the outputs that every run makes. Returns
        their Results. Without any, outputs with a path in the graph are saved there, too.

        `save`: paths by output, or one path, or a list: the ending chooses the output. `threads` 0: one per processor.
        `progress(node, done, total, unit)` is called while nodes run. It cancels by raising, or by returning any false
        value but None.
        """
        saves = save if isinstance(save, Mapping) else {} if save is None else {None: save}
        names = want or (() if saves else self._made)
        ports = {name: self.outputs.get(name, name) for name in names}
        job, self._job = self._current(), None
        for output, paths in saves.items():
            for path in paths if isinstance(paths, (list, tuple)) else [paths]:
                job.call(_lib.qmat_job_save, _bytes(output) if output else _ffi.NULL, _bytes(path, os.fsencode))
        if names is self._made:  # requests alone save nothing
            for output in job.json(_lib.qmat_job_graph)["outputs"]:
                if output["path"] is not None:
                    job.call(_lib.qmat_job_save, _bytes(output["name"]), _ffi.NULL)
        for port in ports.values():
            job.call(_lib.qmat_job_want, _bytes(port))
        job.run(threads, progress)
        return Results(job, ports)


# ---- the medial mesh of a model ----

Errors = namedtuple("Errors", "surface_to_envelope envelope_to_surface epsilon certified diagonal")
Errors.__doc__ = """Both errors as proved upper bounds, and the epsilon that was asked for, in the units of the model.
certified: both are at most epsilon, proved for all points. diagonal: of the model's bounding box; a share of it is what
epsilon is given in."""


class MedialMesh(Medial):
    """What `mat` returns: a medial mesh with its errors. `report` is that of the whole run."""

    def __init__(self, results, settings, cache):
        medial = results["simple.medial"]
        super().__init__(medial._job, medial._port, medial.type, medial.name, medial.arrays)
        self._results, self._settings, self._cache = results, settings, cache
        measured = results["errors.report"]
        scale = measured["diagonal"]
        self.errors = Errors(scale * measured["surface_to_envelope"], scale * measured["envelope_to_surface"],
                             scale * measured["epsilon"], measured["certified"], scale)

    report = property(lambda self: self._results.report)
    solid = property(lambda self: self._results["solid.mesh"], doc="The mesh that the errors refer to.")

    def _continue(self, graph, names):
        for name in names:
            graph.give(name, self._results[name])
        return graph

    def colliders(self, *, threads=0, progress=None, **parameters):
        """Colliders: parameters are those of the node medial.colliders (fit="contain", kind="spheres", shapes=16)."""
        graph = Graph(text=_COLLIDERS, cache=self._cache)
        graph.set({f"colliders.{name}": value for name, value in parameters.items()})
        self._continue(graph, ["solid.mesh", "simple.medial"])
        results = graph.run("colliders.colliders", "colliders.report", threads=threads, progress=progress)
        colliders = results["colliders.colliders"]
        colliders.report = results["colliders.report"]
        return colliders

    def envelope(self, *, threads=0, progress=None, **parameters):
        """The envelope as a Mesh: parameters are those of the node medial.skin."""
        graph = self._continue(Graph(cache=self._cache), ["solid.mesh", "simple.medial"])
        graph.set({f"skin.{name}": value for name, value in parameters.items()})
        return graph.run("skin.mesh", threads=threads, progress=progress)["skin.mesh"]

    def save(self, *paths, threads=0, progress=None):
        """Writes the file; its ending is the format: .glb, .gltf, .usda, .usdc, .usdz, .ma, .ply; .html, a page; .png, .svg,
        a picture."""
        graph = Graph(cache=self._cache).set(self._settings)
        self._continue(graph, ["model.scene", "solid.mesh", "simple.medial", "errors.report"])
        graph.run(save={None: list(paths)}, threads=threads, progress=progress)


_COLLIDERS = """
qmat: 1
nodes:
  solid: { type: mesh.solid, in: { mesh: model.mesh } }
  model: { type: scene.read }
  simple: { type: medial.read }
  colliders: { type: medial.colliders, in: { mesh: solid.mesh, medial: simple.medial } }
outputs: { colliders: colliders.colliders, report: colliders.report }
"""


def mat(V, F=None, *, epsilon=None, vertices=None, features=None, set=(), name=None, cache=None, threads=0,
        progress=None):
    """The medial mesh of a model: of vertices V (n, 3) and triangles F (m, 3), counter-clockwise from outside, or of the
    file that V names.

    epsilon: the largest distance between surface and envelope, as a share of the diagonal of the model's bounding box
    (.01), or a length ("5mm") where the file has a unit; arrays have none. vertices: the number of spheres to stop at.
    Without epsilon, the result has at most this many spheres, at the least distance that they allow. With epsilon,
    collapsing stops at this number; where epsilon needs more spheres, more are left. features="sharp" keeps sharp edges. set: other parameters by name
    ({"model.mesh": "merged"}); with arrays none of the node model, which does not run. cache, threads, progress: as those
    of Graph.
    """
    graph = Graph(cache=cache)
    settings = dict(set)
    settings.update({key: value for key, value in
                     (("epsilon", epsilon), ("vertices", vertices), ("features", features)) if value is not None})
    if vertices is not None and "epsilon" not in settings:
        settings = {"epsilon": 0, **settings}  # that number of spheres at any distance
    graph.set(settings)
    if F is not None:
        for key in settings:
            node, _, field = key.partition(".")
            if node == "model":
                message = f"'{key}' cannot be set with arrays: the node 'model' does not run, and arrays have no unit"
                raise UsageError(message, status="usage", node=node, field=field, message=message)
        graph.give("model.mesh", V, F, name=name)
    elif isinstance(V, (str, os.PathLike)):
        graph.set(model=V)
    else:
        raise TypeError("a model is a path, or two arrays V and F")
    results = graph.run("simple.medial", "errors.report", "solid.mesh", "model.scene", threads=threads,
                        progress=progress)
    if isinstance(results["simple.medial"], list):
        message = f"the scene has {len(results['simple.medial'])} meshes, and mat() describes one"
        hint = 'qmat.mat(..., set={"model.mesh": "merged"}), or the name of a mesh there; qmat.Graph describes each'
        raise UsageError(f"{message} ({hint})", status="usage", message=message, hint=hint)
    return MedialMesh(results, settings, cache)
