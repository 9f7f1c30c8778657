# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python module in cells, as a notebook has them (Jupyter, VS Code and Spyder run `# %%` one by one).

    python3 notebook.py [MODEL] [PICTURE.svg]
"""
# %% A model: a file, or arrays. This one is a knotted tube whose radius varies.
import sys

import numpy as np

import qmat


def tube(around=240, sides=20):
    t = 2 * np.pi * np.arange(around)[:, None] / around
    curve = np.hstack([np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t), -np.sin(3 * t)])
    along = np.roll(curve, -1, 0) - np.roll(curve, 1, 0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    outwards = curve * [1, 1, 0] - along * (curve * [1, 1, 0] * along).sum(1, keepdims=True)
    outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
    turn = 2 * np.pi * np.arange(sides)[None, :, None] / sides
    ring = np.cos(turn) * outwards[:, None] + np.sin(turn) * np.cross(along, outwards)[:, None]
    V = (curve[:, None] + (.35 + .12 * np.cos(6 * t))[:, None] * ring).reshape(-1, 3)
    i, s = np.meshgrid(np.arange(around), np.arange(sides), indexing="ij")
    a, b = i * sides + s, i * sides + (s + 1) % sides
    c, d = (a + sides) % len(V), (b + sides) % len(V)
    return V, np.stack([a, b, d, a, d, c], -1).reshape(-1, 3)


paths = [path for path in sys.argv[1:] if not path.endswith(".svg")]
pictures = [path for path in sys.argv[1:] if path.endswith(".svg")] or ["notebook.svg"]
if paths:
    mesh = qmat.Graph().set(model=paths[0]).run("solid.mesh")["solid.mesh"]
    V, F = mesh.vertices, mesh.triangles
else:
    V, F = tube()

# %% Its medial mesh, with a line of progress. Ctrl-C cancels.
m = qmat.mat(V, F, epsilon=.01, progress=lambda node, done, total, unit: print(f"\r{node:<12}", end="", file=sys.stderr))
print("\r", end="", file=sys.stderr)
print(f"{len(F)} triangles: {len(m.spheres)} spheres, {len(m.cones)} cones, {len(m.slabs)} slabs")
print(f"surface to envelope {m.errors.surface_to_envelope:.4f}, envelope to surface "
      f"{m.errors.envelope_to_surface:.4f}: {'' if m.errors.certified else 'not '}certified for {m.errors.epsilon:.4f}")

# %% The error at each vertex of the surface.
error = m.error_at(V)
share = np.count_nonzero(abs(error) < m.errors.epsilon / 2) / len(V)
print(f"{share:.0%} of the vertices are within half of epsilon; the farthest is {abs(error).max():.4f} away")

# %% Shapes for a physics engine.
colliders = m.colliders(kind="capsules")
print(f"{len(colliders.shapes)} colliders, mass {colliders.mass:.3f}, centre {np.round(colliders.centre, 3) + 0.}")

# %% A graph, and values between its nodes: thickness, as the shape diameter function has it.
graph = qmat.Graph().give("model.mesh", V, F)
thickness = graph.run("thickness.thickness")["thickness.thickness"].arrays["values"]
print(f"thickness from {thickness.min():.3f} to {thickness.max():.3f}")


# %% A picture: the surface by its signed error (red: the envelope lacks volume), and the medial mesh inside it.
def picture(path, width=460, height=460):
    view = np.array([[.8, .6, 0], [.3, -.4, .866], [.52, -.693, -.5]]).T  # right, up, away
    points, spheres = V @ view, m.centres @ view
    low, high = points[:, :2].min(0), points[:, :2].max(0)
    scale = min((width - 30) / (high - low)[0], (height - 30) / (high - low)[1])

    def place(p):
        return (p[:, :2] - (low + high) / 2) * scale * [1, -1] + [width / 2, height / 2]

    corners = points[F]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    light = .72 + .28 * np.clip(normal @ [.3, .5, -.8] / np.maximum(np.linalg.norm(normal, axis=1), 1e-300), 0, 1)
    at = np.clip(error[F].mean(1) / m.errors.epsilon, -1, 1)[:, None]
    colour = np.where(at > 0, [250, 250, 250] - at * [20, 170, 185], [250, 250, 250] + at * [190, 120, 25])
    xy, flat = place(points), []
    for f in np.argsort(-corners[:, :, 2].mean(1)):
        if np.cross(*(xy[F[f, 1:]] - xy[F[f, 0]])) < 0:  # towards the eye
            rgb = "#%02x%02x%02x" % tuple((colour[f] * light[f]).astype(int))
            flat.append(f'<path d="M{" ".join("%.1f %.1f" % tuple(p) for p in xy[F[f]])}z" fill="{rgb}" stroke="{rgb}"/>')
    balls, drawn = place(spheres), []
    for i in np.argsort(-spheres[:, 2]):
        drawn.append('<circle cx="%.1f" cy="%.1f" r="%.1f" fill="#5b8dd6" fill-opacity=".25"/>' %
                     (*balls[i], m.radii[i] * scale))
    for ids in m.slabs:
        drawn.append(f'<path d="M{" ".join("%.1f %.1f" % tuple(p) for p in balls[ids])}z" fill="#e8a33d" opacity=".6"/>')
    for a, b in m.cones:
        aside = (balls[b] - balls[a])[::-1] * [1, -1] / max(np.linalg.norm(balls[b] - balls[a]), 1e-300) * scale
        cone = [balls[a] + m.radii[a] * aside, balls[b] + m.radii[b] * aside, balls[b] - m.radii[b] * aside,
                balls[a] - m.radii[a] * aside]
        drawn.append(f'<path d="M{" ".join("%.1f %.1f" % tuple(p) for p in cone)}z" fill="#9dbce8" opacity=".4"/>')
        drawn.append('<path d="M%.1f %.1fL%.1f %.1f" stroke="#1c3d6e" stroke-width="2"/>' % (*balls[a], *balls[b]))
    drawn += ['<circle cx="%.1f" cy="%.1f" r="3" fill="#c0392b"/>' % tuple(ball) for ball in balls]
    with open(path, "w") as file:
        file.write(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {2 * width} {height}" stroke-width=".5">\n'
                   '<rect width="100%" height="100%" fill="#fff"/>\n' + "\n".join(flat) +
                   f'\n<g transform="translate({width} 0)">\n' + "\n".join(drawn) + "\n</g>\n</svg>\n")


picture(pictures[0])
print(pictures[0])
