# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs examples/notebook.py and judges what it prints and draws: python3 example_test.py SOURCE_FOLDER PROGRAM"""
import re
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml

with tempfile.TemporaryDirectory() as folder:
    picture = f"{folder}/picture.svg"
    run = subprocess.run([sys.executable, f"{sys.argv[1]}/examples/notebook.py", picture], cwd=folder,
                         capture_output=True, text=True)
    print(run.stdout, run.stderr)
    assert run.returncode == 0
    triangles, spheres, cones = map(int, re.match(r"(\d+) triangles: (\d+) spheres, (\d+) cones", run.stdout).groups())
    assert triangles == 9600 and 10 <= spheres <= 200
    assert cones == spheres  # a knot is one loop
    assert ": certified for" in run.stdout
    assert re.search(r"^thickness from 0\.\d+ to \d", run.stdout, re.M)
    drawing = xml.parse(picture).getroot()
    tag = "{http://www.w3.org/2000/svg}"
    assert len(drawing.findall(f"{tag}g/{tag}circle")) == 2 * spheres
    assert len(drawing.findall(f"{tag}g/{tag}path[@stroke-width]")) == cones
    assert triangles / 3 < len(drawing.findall(f"{tag}path")) < 2 * triangles / 3  # those that face the eye
