#!/usr/bin/env python3
"""Compares two builds of the program: every command line must give the same bytes.

usage: same_bits.py --before OLD --after NEW [--only TEXT] [--jobs N] [--numbers] [--verbose] | --self-test --before OLD

Runs each command line of the table below with both programs, each in a fresh folder that holds copies of the same inputs:
models of data/models, small meshes and images that OLD makes once, and broken files that this script writes. Compares
stdout, stderr, the exit code and every file in the folder, byte for byte. stderr is a pipe, so that no progress bar is in
it. MASKS lists the texts that differ between two runs of one program; only these, the version and the folder's path are
masked. Both programs run on one machine, so that devices and numbers of threads are compared too.

With --numbers messages may be worded anew: exit codes, JSON but for the texts in it, numbers in tables, images and meshes are
compared, and neither stderr nor pages.

Every command line states --mode and --backend where its command has them, so that other defaults change no result.

Prints the number of command lines, how many are the same, and a short diff of each that differs. Exits 1 if any differs,
or if OLD succeeds where the table expects an error or fails where it expects none. `--self-test` disturbs results of OLD
and exits 1 unless the comparison finds every disturbance.
"""

import argparse
import collections
import concurrent.futures
import csv
import dataclasses
import difflib
import json
import os
import re
import shlex
import shutil
import stat
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

MODELS = Path(__file__).resolve().parents[2] / "data" / "models"

# Seconds after which a command counts as hanging.
TIMEOUT = 300

# The name that both programs are started under, which messages and reports repeat.
NAME = "ldi-ops"

# The placeholder for the folder that a command runs in.
HERE = "{here}"

# Commands that take --mode, and those that take --backend.
WITH_MODE = "intersect union difference xor csg minkowski offset open close volume sample surface".split()
WITH_BACKEND = [command for command in WITH_MODE if command != "surface"] + ["report", "render"]

# Files whose bytes are text. Others are compared as they are.
TEXTS = (".json", ".csv", ".txt", ".html", ".toml")

# Inputs that OLD makes once, in this order: meshes in every format, with and without a unit, and images.
MADE = """
generate geodesic --frequency 6 -o ball.stl
generate geodesic --radius 1.5 --frequency 2 -o bead.stl
generate torus --around 32 --across 16 -o ring.obj
generate cylinder --radius 3 --height 30 --segments 24 -o rod.ply
generate cuboid --min -8,-8,-8 --max 8,8,8 -o block.off
generate ell --size 12,10,8 -o ell.3mf
generate hollow-box -o hollow.glb
generate bcc --form overlapping --cells 1 --segments 8 -o struts.stl
generate gyroid --cells 1 --wall 2 --resolution 12 -o sheet.stl
generate primitive --part network --cells 1 --resolution 12 -o network.stl
generate chain --links 3 --around 24 --across 10 -o links.stl
generate cuboid --min 1000,2000,-3000 --max 1007,2005,-2997 -o far.obj
generate star -o star.obj
sample ball.stl --mode exact --resolution 24 -o ball.npz
sample ring.obj --mode over --resolution 32 --unit mm -o over.npz
sample ring.obj --mode under --resolution 32 -o under.npz
sample ell.3mf --mode exact --resolution 24 -o ell.npz
sample ball.stl --mode exact --axis x --resolution 24 -o along_x.npz
""".strip().splitlines()

# Command lines that succeed. Lines are completed by `complete`; {here} is the folder that the command runs in.
COMMON = """
intersect ball.stl block.off --resolution 48
intersect sphere.stl box.stl --resolution 64 --json -
intersect bone.stl gyroid_sheet.stl --resolution 64 -v
intersect ball.stl ring.obj rod.ply --resolution 40 -v --json result.json
intersect ball.stl block.off --resolution 32 --transform-b 'translate(1,2,3) rotate(0,0,1,30)' --json -
intersect ball.stl block.off --resolution 32 --transform-a 'scale(1,2,0.5)' -v
intersect ball.stl block.off ring.obj --resolution 32 --transform c='rotate(1,1,0,45) scale(1.5)' --json -
intersect ball.stl ball.stl --resolution 24 --transform-b 'translate(19.9,0,0)' -v
intersect ball.stl far.obj --resolution 24 -v --json result.json
intersect ball.stl block.off --resolution 32 --unit mm --transform-b 'translate(100um,0,0)'
intersect ball.stl ell.3mf --resolution 32 --unit in --json -
intersect ball.stl hollow.glb --resolution 32 --transform-b 'scale(0.5)'
intersect {here}/ball.stl ./block.off --resolution 24 --json -
intersect ball.stl block.off --pitch 0.7 -v
intersect ball.stl block.off --pitch 0.5mm --unit mm --json -
intersect ball.stl block.off --tolerance 2% --json - -v
intersect ball.stl ring.obj --tolerance 0.01 --axis z
intersect struts.stl ball.stl --fill nonzero --resolution 48 --json -
intersect struts.stl ball.stl --fill even-odd --resolution 48 -v
intersect open.obj ball.stl --allow-open --resolution 32 -v --json result.json
intersect ball.stl block.off --resolution 48 --threads 1 --json -
intersect ball.stl block.off --resolution 48 --threads 3 -v
intersect ball.stl block.off --resolution 32 -q
intersect ball.stl ring.obj --mode over --lod 32 --resolution 32 --json -
intersect ball.stl ring.obj --mode under --lod 65536 --resolution 32 --json -
common sphere.stl torus.stl --resolution 32
union ball.stl block.off --resolution 48 -v
union links.stl ring.obj star.obj --resolution 48 --json -
union ball.stl block.off --resolution 32 --transform-b 'translate(40,0,0)' -o parts.stl
union cylinder.stl torus.stl bcc_lattice.stl --resolution 64 -v
union struts.stl ring.obj --fill nonzero --resolution 40 -o union.obj --json -
union ball.stl over.npz --resolution 32 -v
join ball.stl rod.ply --resolution 24
difference block.off rod.ply --resolution 48 -v
difference block.off rod.ply rod.ply --resolution 48 --transform c='rotate(1,0,0,90)' --json - -o cross.stl
difference hollow.glb ball.stl --resolution 40 --unit m --transform-b 'scale(0.0005)' --json -
difference sphere.stl sphere.stl --resolution 32 -v
minus ball.stl star.obj --resolution 32 -q --json -
xor ball.stl block.off --resolution 48 --json -
xor ring.obj rod.ply links.stl --resolution 40 -v
xor gyroid_sheet.stl primitive_sheet.stl --resolution 48 --axis y -v
csg 'a & (b | c) - d' a=ball.stl b=ring.obj c=rod.ply d=ell.3mf --resolution 48 --json -
csg 'a ^ b' a=ball.stl b=block.off --resolution 32 -v -o csg.npz
csg 'part - (a1 | a2)' part=block.off a1=rod.ply a2=rod.ply --transform a2='rotate(0,1,0,90)' --resolution 40 -o csg.stl
csg 'a - a' a=ball.stl --resolution 16 -v
csg 'größe | b' größe=ball.stl b=star.obj --resolution 24 --unit cm --json -
csg 'a & b | a - b' a=ball.stl b=ring.obj --pitch 0.9 --fill nonzero -v
csg 'a - b' a=ball.stl b=rod.ply --tolerance 3% --json -
csg 'a | o' a=ball.stl o=open.obj --allow-open --resolution 24 --json -
volume ball.stl --resolution 48 -v
volume ball.stl ring.obj rod.ply block.off ell.3mf hollow.glb --resolution 32 --json volumes.json -v
volume bone.stl --resolution 64 --json -
volume sphere.stl --tolerance 1% -v
volume ring.obj --tolerance 0.5% --json -
volume struts.stl --fill nonzero --resolution 64 -v
volume struts.stl --fill even-odd --resolution 64 --json -
volume diamond_network.stl --resolution 64 --axis z -v
volume cubic_lattice.stl --resolution 48 -q
volume geodesic.obj --pitch 0.8 --json -
volume geodesic.obj --resolution 32 --unit um
volume ell.3mf --resolution 32 --transform-a 'rotate(1,2,3,40) translate(5mm,0,0)' --json -
volume open.obj --allow-open --resolution 40 -v --json result.json
volume inverted.obj --resolution 24 -v --json result.json
volume turned.obj --resolution 24 -v
volume twice.obj --fill nonzero --resolution 24 --json -
volume crossed.obj --fill even-odd --resolution 32 -v
volume crossed.obj --fill nonzero --resolution 32 -v
volume tetrahedron.gltf --resolution 24 --json -
volume ball.npz --resolution 24 -v
volume far.obj --resolution 32 -v
volume links.stl --resolution 48 --threads 1 -v
sample ball.stl --resolution 32 -o ball_2.npz -v
sample ball.stl --resolution 32 --unit mm -o ball_2.npz --json -
sample struts.stl --fill nonzero --resolution 40 -o struts.npz
sample ring.obj --resolution 48 --axis x -o ring.vti
sample open.obj --allow-open --resolution 32 -o open.npz --json -
sample ring.obj --resolution 40 -o ring.stl -v
sample sheet.stl --pitch 0.5 --transform-a 'rotate(0,0,1,15)' -o sheet.npz --json sheet.json
sample ball.stl --tolerance 2% -o ball_2.npz -v
sample far.obj --resolution 32 --recentre -o far.glb --json -
sample far.obj --resolution 32 --recentre -o far.3mf -v
sample far.obj --resolution 32 --recentre -o far.stl
sample links.stl --resolution 48 --drop-parts 10% -o links.ply --json -
sample ring.obj --resolution 40 --simplify 0.2h -o ring.off -v
sample ring.obj --resolution 40 --simplify 0.05 -o ring.ply --json -
sample ring.obj --resolution 40 --simplify 20um --unit mm -o ring.3mf
surface ball.npz -o ball.obj -v
surface ball.npz -o ball.ply --json -
surface ball.npz --simplify 0.1h -o small.stl --json small.json -v
surface ball.npz --unit mm -o ball.3mf
surface ball.npz -o ball.vti
surface ball.npz -o ball.npy -v
surface ball.npz --drop-parts 0.1% --recentre -o ball.glb --json -
surface over.npz --mode over -o ring.stl -v
surface over.npz --mode over -o ring.off --json -
surface under.npz --mode under -o ring.stl
surface ell.npz -o ell.stl -q
surface ell.npz -o copy.npz -v
minkowski ball.stl bead.stl --resolution 32 -v
minkowski block.off bead.stl --resolution 32 --json - -o sum.stl
minkowski ell.3mf bead.stl --reflect --resolution 32 -v -o sum.obj
minkowski block.off bead.stl --difference --resolution 32 -v -o rest.ply
minkowski star.obj bead.stl --difference --resolution 24 --json -
minkowski ring.obj ell.3mf --reflect --difference --resolution 24 --unit mm -v
minkowski star.obj bead.stl --resolution 24 --axis x -v --json sum.json -o sum.npz
minkowski rod.ply bead.stl --pitch 1 --transform-a 'rotate(1,0,0,90)' --transform-b 'scale(2)' -o sum.vti
minkowski struts.stl bead.stl --fill nonzero --resolution 24 -v
minkowski ball.stl block.off --difference --resolution 24 -v --json -
minkowski box.stl cylinder.stl --resolution 24 --memory 4G -o sum.npy
minkowski ring.obj bead.stl --resolution 24 --simplify 0.1h -o sum.3mf --unit mm --json -
offset block.off --distance 1 --resolution 32 -v -o grown.stl
offset block.off --distance -1 --resolution 32 -v -o shrunk.obj
offset ring.obj --distance -0.7 --resolution 32 --json -
offset ring.obj --distance 0.7 --resolution 32 --axis y --json -
offset sheet.stl --distance 200um --unit mm --resolution 32 -o grown.npz
offset struts.stl --distance 0.5 --fill nonzero --resolution 32 -v
offset ball.stl --distance -1000 --resolution 16 -v --json result.json
offset ell.3mf --distance 0.5 --pitch 0.7 --simplify 0.1h --recentre -o grown.glb --json -
offset torus.stl --distance 0.5 --resolution 24 --threads 1 -v
open ell.3mf --radius 1 --resolution 32 -v -o opened.stl
open star.obj --radius 0.5 --resolution 32 --json - -o opened.npz
open ball.stl --radius 100 --resolution 16 -v
open sheet.stl --radius 300um --unit mm --resolution 24 -o opened.vti
close ell.3mf --radius 1 --resolution 32 -v -o closed.stl
close links.stl --radius 1 --resolution 32 --json - -o closed.off
close star.obj --radius 0.5 --resolution 24 --fill nonzero -o closed.npy
close network.stl --radius 0.5 --pitch 0.5 --drop-parts 1% -o closed.ply -v
report sheet.stl --resolution 24 --tortuosity-resolution 16 -o out
report sheet.stl --resolution 32 --tortuosity-resolution 24 --unit mm -v --json out.json -o out
report sheet.stl --resolution 24 --tortuosity-resolution 16 --edges clip --json - -o out
report sheet.stl --resolution 24 --tortuosity-resolution 16 --edges periodic -v -o out
report network.stl --resolution 24 --tortuosity-resolution 16 --edges border --roi ball.stl -o out
report network.stl --resolution 24 --roi ball.stl --transform-roi 'scale(0.4)' --transform-a 'rotate(0,0,1,20)' -o out
report star.obj --resolution 24 --roi hull --json - -o out
report links.stl --resolution 32 --roi wrap:3mm --unit mm -v -o out
report ring.obj --resolution 24 --roi wrap -q -o out
report sheet.stl --resolution 24 --tortuosity-resolution 16 --unit mm --limits kept.toml -v -o out
report sheet.stl --resolution 24 --tortuosity-resolution 16 --compare network.stl --unit mm -o out
report sheet.stl --resolution 16 --tortuosity-resolution 16 --compare struts.stl --fill nonzero --json - -o out
report sheet.stl network.stl ring.obj --resolution 16 --tortuosity-resolution 16 --unit mm --json - -o out
report sheet.stl network.stl --resolution 16 --tortuosity-resolution 16 --roi hull --unit mm -v -o out
report sheet.stl --pitch 0.5mm --unit mm --build -x --overhang-angle 30 --kozeny 4.5 -o out
report struts.stl --fill nonzero --resolution 24 --build y -o out
report open.obj --allow-open --resolution 24 --tortuosity-resolution 16 -v -o out
report hollow.glb --resolution 24 --threads 1 --json - -o out
render ball.stl --size 160x120 -o a.png -v
render ball.stl block.off --size 160x120 --unit mm --json - -o a.png
render ball.stl block.off --size 120x90 --csg 'a - b' --view x --background dark -o a.png
render ball.stl ring.obj rod.ply --size 120x90 --csg '(a | b) ^ c' --view -60,25 --background transparent -o a.png
render sheet.stl --size 120x90 --slice z=50% -o a.png -v
render sheet.stl --size 120x90 --slice x=0.5mm --unit mm --view iso --facets flat --json - -o a.png
render struts.stl --size 120x90 --fill nonzero --samples 1 --background white --view -z -o a.png
render ring.obj --size 90x120 --samples 5 --transform-a 'rotate(1,0,0,60)' -o a.png -q
render ring.obj ball.stl --size 96x96 --transform b='translate(0,0,4) scale(0.5)' --view y -o a.png
render open.obj --size 96x64 --allow-open -o a.png --json picture.json
check ball.stl
check ball.stl ring.obj rod.ply block.off ell.3mf hollow.glb struts.stl -v
check bone.stl gyroid_sheet.stl --json -
check geodesic.obj -q --json checks.json
check tetrahedron.gltf --unit cm -v --json -
convert ball.stl -o ball.obj -v
convert ball.stl -o ball.ply --json -
convert ring.obj -o ring.off
convert ring.obj -o ring_2.obj --transform-a 'scale(25.4) translate(1,2,3)'
convert rod.ply -o rod.stl -v
convert block.off -o block.3mf --unit mm --json out.json
convert block.off -o block.glb --unit cm
convert block.off -o block.3mf
convert ell.3mf -o ell.stl -q
convert hollow.glb -o hollow.obj --json -
convert hollow.glb -o hollow.ply --transform-a 'rotate(0,0,1,45)'
convert far.obj -o far.glb --recentre --unit mm -v
convert far.obj -o far.stl --recentre --json -
convert far.obj -o far.3mf --recentre --unit in
convert tetrahedron.gltf -o tetrahedron.stl
convert open.obj -o open.stl -v
convert ball.npz -o ball_2.stl -v
generate sphere --radius 2.5 --segments 16 -o a.stl -v
generate cuboid --min 0,0,0 --max 1,2,3 -o a.off --json -
generate box -o a.3mf
generate ell -o a.glb
generate hollow-box --hollow 4,5,6 -o a.ply -v
generate geodesic --frequency 4 -o a.obj
generate geodesic-frame --frequency 2 -o a.stl -v
generate star --frequency 2 -o a.obj --json a.json
generate torus --around 24 --across 12 -o a.ply -q
generate cylinder --segments 12 -o a.off
generate hyperboloid --segments 16 --zones 8 -o a.stl -v
generate hyperboloid-frame --bars 16 --crossings 3 -o a.stl -v
generate knot --p 3 --q 2 -o a.obj -v
generate chain --links 2 --around 16 --across 8 -o a.3mf --json -
generate chain-mail --columns 2 --rows 2 --around 16 --across 8 -o a.stl
generate weave --segments 8 --steps 4 -o a.ply
generate brush --bristles 2 --resolution 8 -o a.stl -v
generate gyroid --part network --fraction 0.4 --cells 1 --resolution 12 -o a.stl -v
generate gyroid --wall 2 --cells 2,1,1 --resolution 12 -o a.obj --json -
generate primitive --wall 2 --cells 1 --resolution 12 -o a.off
generate diamond --part network --cells 1 --resolution 12 -o a.glb -v
generate cubic --form overlapping --cells 2 --segments 8 -o a.stl
generate cubic --cells 1 --resolution 12 -o a.stl -v
generate bcc --cells 1 --resolution 16 -o a.ply --json -
generate bone --resolution 48 -o a.obj -v
generate trabecular --size 2,2,2 --resolution 8 --seed 7 -o a.stl --json -
generate organic --resolution 24 -o a.stl -v
generate skull --resolution 38 -o a.stl --threads 1
""".strip().splitlines()

# Outputs that exist before the command runs; it replaces them or adds to them.
REPLACING = """
convert ball.stl -o old.obj -v
intersect ball.stl block.off --resolution 24 -o old.stl --json old.json
sample ball.stl --resolution 24 -o old.npz
render ball.stl --size 64x48 -o old.png
generate cuboid -o old.3mf
report ring.obj --resolution 16 -o old
""".strip().splitlines()
OLD_FILES = ("old.obj", "old.stl", "old.json", "old.npz", "old.png", "old.3mf", "old/metrics.csv", "old/notes.txt")

# Command lines that fail: usage, inputs, and checks that are false.
FAILING = """
bogus ball.stl
intersect ball.stl --resolution 16
intersect missing.stl ball.stl --resolution 16
intersect ball.stl open.obj --resolution 16
intersect ball.stl block.off --resolution 16 --colour red
intersect ball.stl block.off --resolution 16 --mode perhaps
intersect ball.stl block.off --resolution 16 --fill odd
intersect ball.stl block.off --resolution 16 --axis w
intersect ball.stl block.off --resolution 16 --unit parsec
intersect ball.stl block.off --resolution 16 --threads 0
intersect ball.stl block.off --resolution 16 --lod 3
intersect ball.stl block.off --resolution 16 --adapter any
intersect ball.stl block.off --resolution 0
intersect ball.stl block.off --resolution 70000
intersect ball.stl block.off --resolution many
intersect ball.stl block.off --resolution 16 --pitch 1
intersect ball.stl block.off --pitch 0.00000001
intersect ball.stl block.off --pitch -1
intersect ball.stl block.off --pitch 1mm
intersect ball.stl block.off --tolerance 0
intersect ball.stl block.off --tolerance 200%
intersect ball.stl block.off --resolution 16 --transform-a 'rotate(1)'
intersect ball.stl block.off --resolution 16 --transform-a 'scale(0)'
intersect ball.stl block.off --resolution 16 --transform-b 'twist(1,2,3)'
intersect ball.stl block.off --resolution 16 --transform-b 'translate(1,2'
intersect ball.stl block.off --resolution 16 --transform d='scale(2)'
intersect ball.stl block.off --resolution 16 -o out.png
intersect ball.stl block.off --resolution 16 -o out
intersect ball.stl block.off --resolution 16 -o none/out.stl
intersect ball.stl block.off --resolution 16 -o ball.stl
intersect ball.stl block.off --resolution 16 -o out.stl --json out.stl
intersect ball.stl block.off --resolution 16 --json block.off
intersect ball.stl block.off --resolution 16 -o out.stl --simplify 2x
intersect ball.stl block.off --resolution 16 --simplify 0.1h
intersect ball.stl block.off --resolution 16 --axis x -o out.stl
union ball.stl twice.obj --resolution 16
union ball.stl twice.obj --resolution 16 --json -
difference ball.stl nan.obj --resolution 16
xor ball.stl empty.stl --resolution 16
csg 'a &' a=ball.stl --resolution 16
csg 'a & b' a=ball.stl --resolution 16
csg 'a' a=ball.stl b=ring.obj --resolution 16
csg '(a | b' a=ball.stl b=ring.obj --resolution 16
csg 'a | b' a=ball.stl ring.obj --resolution 16
volume text.stl --resolution 16
volume cut.stl --resolution 16
volume turned.obj --fill nonzero --resolution 16
volume ball.stl missing.stl ring.obj --resolution 16 --json -
volume nan.obj --allow-open --resolution 16
volume flat.obj --resolution 16
volume ball.stl --resolution 16 --tolerance 1%
sample ball.stl --resolution 16
sample ball.stl --resolution 16 -o ball.xyz
surface ball.stl -o out.stl
surface missing.npz -o out.stl
surface along_x.npz -o out.stl
surface cut.npz -o out.stl
surface over.npz --mode under -o out.stl
minkowski ball.stl open.obj --resolution 16
minkowski ball.stl bead.stl --resolution 16 --memory 1M
minkowski ball.stl bead.stl --resolution 16 --allow-open
minkowski turned.obj bead.stl --resolution 16
offset ball.stl --resolution 16
offset ball.stl --distance far --resolution 16
offset ball.stl --distance 1mm --resolution 16
open ball.stl --radius -1 --resolution 16
close open.obj --radius 1 --resolution 16
report ball.stl --resolution 16
report ball.stl --resolution 16 --edges mirror -o out
report ball.stl --resolution 16 --roi missing.stl -o out
report ball.stl --resolution 16 --roi open.obj -o out
report ball.stl --resolution 16 --limits missing.toml -o out
report ball.stl --resolution 16 --limits wrong.toml -o out
report sheet.stl --resolution 16 --tortuosity-resolution 16 --unit mm --limits broken.toml -v -o out
report open.obj --resolution 16 -o out
report ring.obj open.obj --resolution 16 --unit mm --json - -o out
report ball.stl --resolution 16 -o ball.stl
report ball.stl --resolution 16 -o none/out
report sheet.stl network.stl --resolution 16 --tortuosity-resolution 16 --limits broken.toml --unit mm -o out
render ball.stl -o out.stl
render ball.stl --size 0x0 -o out.png
render ball.stl --view nowhere -o out.png
render ball.stl --slice z=500 -o out.png
render ball.stl ring.obj --csg 'a & z' -o out.png
check missing.stl ball.stl
check open.obj -v
check open.obj twice.obj inverted.obj turned.obj crossed.obj nan.obj flat.obj empty.stl text.stl cut.stl --json -
check inverted.obj -q
convert ball.stl -o ball.stl
convert ball.stl -o ball.xyz
convert text.stl -o out.obj
convert missing.stl -o out.obj
generate blob -o out.stl
generate sphere
generate sphere --radius -1 -o out.stl
generate hyperboloid-frame --bars 8 -o out.stl
generate gyroid --wall 0.1 --cells 1 --resolution 12 -o out.stl
""".strip().splitlines()


def systematic() -> Iterator[str]:
    """Yields command lines for each axis in each mode with each fill rule, and for each format in each mode."""
    for axis in ("x", "y", "z", "all"):
        for mode in ("exact", "over", "under"):
            flags = f"--axis {axis} --mode {mode}"
            fill = "even-odd" if (axis in "xz") == (mode == "over") else "nonzero"
            yield f"intersect struts.stl ball.stl {flags} --fill {fill} --resolution 40 --json -"
            yield f"difference block.off links.stl {flags} --fill {fill} --resolution 32 -v"
    for axis in ("x", "y", "z"):
        for mode in ("exact", "over", "under"):
            yield f"sample ring.obj --axis {axis} --mode {mode} --resolution 32 -o image.npz --json -"
    for mode in ("over", "under"):
        for command in ("minkowski ell.3mf bead.stl", "offset ring.obj --distance 0.5", "offset ring.obj --distance -0.5"):
            yield f"{command} --mode {mode} --resolution 24 -v -o result.npz"
        for command in ("open ell.3mf --radius 1", "close ell.3mf --radius 1", "minkowski block.off bead.stl --difference"):
            yield f"{command} --mode {mode} --resolution 24 -o result.stl --json -"
        for command in ("volume", "sample -o image.npz", "sample -o mesh.obj"):
            yield f"{command} ball.stl --mode {mode} --resolution 40 -v"
        yield f"union ball.stl block.off --mode {mode} --tolerance 3% --json -"
        yield f"csg 'a - (b | c)' a=ball.stl b=rod.ply c=ring.obj --mode {mode} --resolution 40 --json -"
        yield f"xor ball.stl block.off --mode {mode} --resolution 32 -v"
    formats = ("stl", "obj", "ply", "off", "glb", "3mf", "npz", "vti", "npy")
    for i, suffix in enumerate(formats):
        operation = ("intersect", "union", "difference", "xor")[i % 4]
        mode = ("exact", "over", "under")[i // 4]
        flags = f"--mode {mode} --resolution 32 --unit mm -v --json result.json"
        yield f"{operation} ball.stl rod.ply {flags} -o result.{suffix}"
        yield f"intersect ball.stl star.obj --mode exact --resolution 24 -o result.{suffix}"


@dataclasses.dataclass(frozen=True)
class Case:
    """A command line: its words without the program's name, and whether it has to fail."""

    words: tuple[str, ...]
    fails: bool = False
    # Files that exist before the command runs, beside its inputs.
    existing: tuple[str, ...] = ()

    def __str__(self) -> str:
        return shlex.join(self.words)


@dataclasses.dataclass(frozen=True)
class Outcome:
    """The result of one run: exit code (None: it did not end in time) and bytes by name: stdout, stderr and all files."""

    code: int | None
    parts: dict[str, bytes]


@dataclasses.dataclass(frozen=True)
class Difference:
    """A part of a result that is not the same, and a short account of it."""

    part: str
    account: list[str]


def complete(line: str, fails: bool = False, existing: tuple[str, ...] = ()) -> Case:
    """Returns the case of a line, with --mode exact and --backend cpu where its command takes them and it states none."""
    words = shlex.split(line)
    command = {"common": "intersect", "join": "union", "minus": "difference"}.get(words[0], words[0])
    if command in WITH_MODE and "--mode" not in words:
        words += ["--mode", "exact"]
    if command in WITH_BACKEND and "--backend" not in words:
        words += ["--backend", "cpu"]
    return Case(tuple(words), fails, existing)


def all_cases() -> list[Case]:
    """Returns all command lines, each once."""
    cases = [complete(line) for line in (*COMMON, *systematic())]
    cases += [complete(line, existing=OLD_FILES) for line in REPLACING]
    cases += [complete(line, fails=True) for line in FAILING]
    for case, count in collections.Counter(cases).items():
        if count > 1:
            raise ValueError(f"the table has this command line {count} times: {case}")
    return cases


# Inputs


CUBE = [(x, y, z) for x in (0, 6) for y in (0, 6) for z in (0, 6)]
CUBE_FACES = [(1, 2, 3), (2, 4, 3), (5, 7, 6), (6, 7, 8), (1, 5, 2), (2, 5, 6), (3, 4, 7), (4, 8, 7), (1, 3, 5), (3, 7, 5),
              (2, 6, 4), (4, 6, 8)]  # fmt: skip


def obj(points: list[tuple], faces: list[tuple]) -> bytes:
    """Returns an .obj file of these points and triangles, which count from 1."""
    lines = [f"v {x} {y} {z}" for x, y, z in points] + [f"f {a} {b} {c}" for a, b, c in faces]
    return ("\n".join(lines) + "\n").encode()


def write_broken(folder: Path) -> None:
    """Writes meshes with defects, files that are no meshes, a .gltf with its buffer, and limits of reports."""
    reversed_faces = [(a, c, b) for a, b, c in CUBE_FACES]
    moved = [(x + 3, y + 3, z + 3) for x, y, z in CUBE]
    second = [(a + 8, b + 8, c + 8) for a, b, c in CUBE_FACES]
    ball = (folder / "ball.stl").read_bytes()
    images = (folder / "ball.npz").read_bytes()
    buffer = b"".join(int(i).to_bytes(1, "little") for i in (0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3))
    # The corners (0, 0, 0), (1, 0, 0), (0, 1, 0) and (0, 0, 1) as little-endian 32-bit floats.
    one, zero = b"\x00\x00\x80\x3f", b"\x00\x00\x00\x00"
    corners = b"".join(one if i == j else zero for i in (None, 0, 1, 2) for j in range(3))
    gltf = """{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5121, "count": 12, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
        "buffers": [{"byteLength": 60, "uri": "tetrahedron.bin"}]}"""
    files = {
        "open.obj": obj(CUBE, CUBE_FACES[1:]),
        "inverted.obj": obj(CUBE, reversed_faces),
        "turned.obj": obj(CUBE, [*reversed_faces[:1], *CUBE_FACES[1:]]),
        "twice.obj": obj(CUBE, CUBE_FACES + CUBE_FACES),
        "crossed.obj": obj(CUBE + moved, CUBE_FACES + second),
        "nan.obj": obj([*CUBE[:-1], (6, 6, "nan")], CUBE_FACES),
        "flat.obj": obj([(0, 0, 0), (1, 1, 1), (2, 2, 2)], [(1, 2, 3), (1, 3, 2)]),
        "empty.stl": b"",
        "text.stl": b"This is not a mesh.\n" * 20,
        "cut.stl": ball[: len(ball) // 2],
        "cut.npz": images[: len(images) // 2],
        "tetrahedron.gltf": gltf.encode(),
        "tetrahedron.bin": corners + buffer,
        "kept.toml": b'porosity = { min = "1 %", max = "99 %" }\npercolation = { min = "1 um" }\n',
        "broken.toml": b'porosity = { max = "1 %" }\n"wall.thinnest" = { min = "9 mm" }\n',
        "wrong.toml": b'beauty = { min = "1 %" }\n',
    }
    for name, content in files.items():
        (folder / name).write_bytes(content)


def make_inputs(program: Path, folder: Path) -> dict[str, bytes]:
    """Makes the shared inputs in a folder, and returns all inputs by name."""
    for model in MODELS.iterdir():
        shutil.copyfile(model, folder / model.name)
    for line in MADE:
        done = subprocess.run(
            [NAME, *complete(line).words, "--quiet"], executable=program, cwd=folder, capture_output=True, timeout=TIMEOUT
        )
        if done.returncode != 0:
            sys.exit(f"{line}: exit code {done.returncode}\n{done.stderr.decode(errors='replace')}")
    write_broken(folder)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def inputs_of(case: Case, inputs: dict[str, bytes]) -> dict[str, bytes]:
    """Returns those inputs whose names are in the command line, and what they refer to."""
    named = {re.split(r"[=/]", word)[-1] for word in case.words}
    if "tetrahedron.gltf" in named:
        named.add("tetrahedron.bin")
    return {name: inputs[name] for name in sorted(named & inputs.keys())}


# Running


def read_all(folder: Path) -> dict[str, bytes]:
    """Returns all entries of a folder by their paths in it: files, with symbolic links and empty folders as remarks."""
    found = {}
    for root, folders, files in os.walk(folder):
        for name in files:
            path = Path(root) / name
            key = path.relative_to(folder).as_posix()
            found[key] = b"link to " + os.readlink(path).encode() if path.is_symlink() else path.read_bytes()
        if not folders and not files and Path(root) != folder:
            found[Path(root).relative_to(folder).as_posix() + "/"] = b"empty folder"
    return found


def run(program: Path, case: Case, inputs: dict[str, bytes]) -> Outcome:
    """Runs a command line in a fresh folder."""
    with tempfile.TemporaryDirectory(prefix="same_bits_") as name:
        folder = Path(name).resolve()
        for file, content in inputs_of(case, inputs).items():
            (folder / file).write_bytes(content)
        for file in case.existing:
            (folder / file).parent.mkdir(exist_ok=True)
            (folder / file).write_bytes(b"before")
        words = [word.replace(HERE, str(folder)) for word in case.words]
        try:
            done = subprocess.run(
                [NAME, *words],
                executable=program,
                cwd=folder,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                timeout=TIMEOUT,
            )
        except subprocess.TimeoutExpired:
            return Outcome(None, {})
        parts = {"stdout": done.stdout, "stderr": done.stderr, **read_all(folder)}
        here = str(folder).encode()
        texts = {key: value.replace(here, HERE.encode()) for key, value in parts.items() if is_text(key)}
        return Outcome(done.returncode, {**parts, **texts})


def version_of(program: Path) -> str:
    """Returns the version that a program states."""
    words = [NAME, "--version"]
    return subprocess.run(words, executable=program, capture_output=True, text=True, check=True).stdout.split()[-1]


# Masking


def is_text(part: str) -> bool:
    """Returns whether a part of a result is text."""
    return part in ("stdout", "stderr") or part.endswith(TEXTS)


def mask_numbers(match: re.Match) -> str:
    """Returns a match with # for its numbers after a colon, a space or an opening tag."""
    return re.sub(r"(?<=[: >])\d[\d.]*(?:e[+-]?\d+)?", "#", match[0])


def mask_times(match: re.Match) -> str:
    """Returns a list of times with # for each time and its unit."""
    return re.sub(r"(<dt>[a-z ]+</dt><dd>)[\d.]+\s(?:ms|s|min)(</dd>)", r"\1#\2", match[0])


# Texts that differ between two runs of one program: a pattern and its replacement. Patterns match within one line, except
# for the object `seconds` and the list of times.
MASKS: tuple[tuple[re.Pattern, str | Callable[[re.Match], str]], ...] = (
    # JSON: seconds of each stage (the stages' names are compared), memory, date.
    (re.compile(r'"seconds": ?\{[^{}]*\}'), mask_numbers),
    (re.compile(r'("(?:peak_memory|estimate|limit)_bytes": ?)\d+'), r"\1#"),
    (re.compile(r'("made": ?")\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ"'), r'\1#"'),
    # Text of -v: "time  0.009 s: read 0.001, …", "memory  16 MB at most; 17 MB were expected", on stdout in older programs.
    (re.compile(r"^(?:ldi-ops: )?(?:time|memory) +\d.*$", re.MULTILINE), mask_numbers),
    # Messages of -v: "read in 0.0012 s", "sampled by 0.02 s", "4256 crossings are expected, and 17990016 bytes".
    (re.compile(r"^(ldi-ops: .*\b(?:in|by) )\d+\.\d+ s\b", re.MULTILINE), r"\1# s"),
    (re.compile(r"^(ldi-ops: \d+ crossings are expected, and )\d+ bytes$", re.MULTILINE), r"\1# bytes"),
    # The refusal of --memory counts the memory that the process has taken already.
    (re.compile(r"^(ldi-ops: error: about )[\d.]+( [kMG]B are needed, )", re.MULTILINE), r"\1#\2"),
    (re.compile(r"^(ldi-ops: error: about .* as )[\d.]+( [kMG]B do not depend on it)", re.MULTILINE), r"\1#\2"),
    # Pages, which have no-break spaces before units: date, memory, and the list of times.
    (re.compile(r"(<li>|<dd>)\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ<"), r"\1#<"),
    (re.compile(r"(<dt>Peak memory</dt><dd>)[\d.]+\s[KMG]iB<"), r"\1#<"),
    (re.compile(r"<summary><h3>Time</h3></summary>\n.*?</details>", re.DOTALL), mask_times),
)


def mask(part: str, content: bytes, version: str) -> bytes:
    """Returns a part of a result with marks for what differs from run to run, and for the program's version."""
    if not is_text(part):
        return content
    text = content.decode(errors="surrogateescape")
    for pattern, mark in MASKS:
        text = pattern.sub(mark, text)
    # methods.txt may break a line before the version.
    text = re.sub(rf'({NAME}\s|"version": ?"){re.escape(version)}(?![\w.]*\w)', r"\1VERSION", text)
    return text.encode(errors="surrogateescape")


def numbers_alone(part: str, content: bytes) -> bytes:
    """Returns a part of a result without its words: JSON without the texts of strings, cells of tables that are numbers, nothing of
    messages and pages, and all of meshes and images."""

    def without_words(value: object) -> object:
        if isinstance(value, dict):
            return {key: without_words(entry) for key, entry in value.items()}
        if isinstance(value, list):
            return [without_words(entry) for entry in value]
        return "" if isinstance(value, str) else value

    def number_or_nothing(cell: str) -> str:
        try:
            return str(float(cell))
        except ValueError:
            return ""

    if not is_text(part):
        return content
    text = content.decode(errors="surrogateescape")
    if part == "stderr" or part.endswith((".html", ".txt")):
        return b""
    if part.endswith(".csv"):
        rows = csv.reader(text.splitlines())
        return "\n".join(",".join(map(number_or_nothing, row)) for row in rows).encode()
    try:
        # The marks of masked numbers are no JSON.
        return json.dumps(without_words(json.loads(re.sub(r"(?<=: )#|(?<=:)#", "0", text))), indent=1).encode()
    except ValueError:
        return b"" if part in ("stdout", "stderr") else content


# Comparing


def account_of_text(before: bytes, after: bytes) -> list[str]:
    """Returns the first lines that differ."""
    lines = [content.decode(errors="replace").splitlines() for content in (before, after)]
    changed = [line for line in difflib.unified_diff(*lines, n=0, lineterm="") if line[:3] not in ("---", "+++")]
    if not changed:
        return ["ends of lines differ"]
    shown = [line if len(line) <= 200 else line[:200] + " …" for line in changed[:12]]
    return shown + ([f"… {len(changed) - 12} more lines"] if len(changed) > 12 else [])


def account_of_bytes(before: bytes, after: bytes) -> list[str]:
    """Returns sizes, and the place and number of the bytes that differ."""
    places = [i for i, (x, y) in enumerate(zip(before, after)) if x != y]
    sizes = f"{len(before)} bytes before, {len(after)} after"
    if not places:
        return [f"{sizes}; the shorter one is the beginning of the longer one"]
    at = places[0]
    first = f"at byte {at}: {before[at : at + 8].hex()} before, {after[at : at + 8].hex()} after"
    return [f"{sizes}; {len(places)} bytes differ, first {first}"]


def compare(before: Outcome, after: Outcome, versions: tuple[str, str], numbers: bool = False) -> list[Difference]:
    """Returns the parts of a result that differ between two runs; only in `numbers`, not in words, on request."""
    found = []
    if before.code != after.code:
        codes = ["no end in time" if code is None else str(code) for code in (before.code, after.code)]
        found.append(Difference("exit code", [f"{codes[0]} before, {codes[1]} after"]))
    for part in sorted(before.parts.keys() | after.parts.keys()):
        if part not in before.parts or part not in after.parts:
            found.append(Difference(part, ["only before" if part in before.parts else "only after"]))
            continue
        old, new = mask(part, before.parts[part], versions[0]), mask(part, after.parts[part], versions[1])
        if numbers:
            old, new = numbers_alone(part, old), numbers_alone(part, new)
        if old != new:
            found.append(Difference(part, (account_of_text if is_text(part) else account_of_bytes)(old, new)))
    return found


@dataclasses.dataclass(frozen=True)
class Pair:
    """Two programs with the inputs of all command lines."""

    before: Path
    after: Path
    versions: tuple[str, str]
    inputs: dict[str, bytes]
    numbers: bool = False

    def differences(self, case: Case) -> list[Difference]:
        """Runs a command line with both programs and returns what differs."""
        before = run(self.before, case, self.inputs)
        found = compare(before, run(self.after, case, self.inputs), self.versions, self.numbers)
        # An unexpected error would hide the part that the command line tests.
        if before.code is None or (before.code != 0) != case.fails:
            message = before.parts.get("stderr", b"").decode(errors="replace").strip()
            expected = "another than 0" if case.fails else "0"
            found.append(Difference("this table", [f"exit code {before.code} before, expected {expected}: {message}"]))
        return found


def compare_all(pair: Pair, cases: list[Case], jobs: int, verbose: bool) -> bool:
    """Compares all command lines, prints what differs, and returns whether nothing does."""
    start = time.monotonic()
    differing = 0

    def timed(case: Case) -> tuple[float, list[Difference]]:
        since = time.monotonic()
        found = pair.differences(case)
        return time.monotonic() - since, found

    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        for case, (seconds, found) in zip(cases, pool.map(timed, cases)):
            if verbose:
                print(f"{seconds:7.2f} s  {'DIFFERS' if found else 'same':8}{case}", flush=True)
            if not found:
                continue
            differing += 1
            print(f"DIFFERS: {NAME} {case}", flush=True)
            for difference in found:
                print(f"  {difference.part}")
                for line in difference.account:
                    print(f"    {line}")
    failing = sum(case.fails for case in cases)
    print(
        f"{len(cases)} command lines, {failing} of them errors: {len(cases) - differing} the same, {differing} differ; "
        f"{time.monotonic() - start:.0f} s"
    )
    return differing == 0


# Testing the comparison itself


# Programs that run OLD and then disturb its result; `code`, `out` and `args` are OLD's exit code, stdout and arguments.
WRAPPER = """#!{python}
import pathlib, re, subprocess, sys
args = sys.argv[1:]
done = subprocess.run([{name!r}, *args], executable={program!r}, stdin=subprocess.DEVNULL, capture_output=True)
code, out, errors = done.returncode, done.stdout, done.stderr
written = pathlib.Path(args[args.index("-o") + 1]) if "-o" in args else None
{disturbance}
sys.stdout.buffer.write(out)
sys.stderr.buffer.write(errors)
sys.exit(code)
"""

# A disturbance: its description, its code, and whether it has to be found.
FLIP = "data = bytearray(written.read_bytes()); data[len(data) // 2] ^= 1; written.write_bytes(data)"
DISTURBANCES = (
    ("nothing", "pass", False),
    ("other seconds", 'errors = re.sub(rb"(time +)[0-9.]+ s", rb"\\g<1>99.999 s", errors)', False),
    ("other memory", 'errors = re.sub(rb"[0-9]+ MB at most", rb"12345 MB at most", errors)', False),
    ("a changed byte in the output", FLIP, True),
    ("an output that lacks its last byte", "written.write_bytes(written.read_bytes()[:-1])", True),
    ("no output", "written.unlink()", True),
    ("one more file", 'pathlib.Path("more.txt").write_text("")', True),
    ("one more folder", 'pathlib.Path("more").mkdir()', True),
    ("a changed input", 'pathlib.Path("ball.stl").write_bytes(b"")', True),
    ("a changed figure in stdout", 'out = re.sub(rb"[0-9]", lambda x: b"%d" % (9 - int(x[0])), out, count=1)', True),
    ("a stage that is called otherwise", 'errors = errors.replace(b": read ", b": load ")', True),
    ("one more line on stderr", 'errors += b"ldi-ops: warning: another\\n"', True),
    ("another exit code", "code = 1", True),
    ("death by a signal", "import os, signal; os.kill(os.getpid(), signal.SIGKILL)", True),
)

# Command lines whose results have every kind of part.
SAMPLES = (
    "intersect ball.stl block.off --resolution 24 -v -o out.stl --json out.json",
    *(f"union ball.stl rod.ply --resolution 24 -o out.{suffix}" for suffix in ("obj", "ply", "off", "glb", "3mf")),
    *(f"sample ball.stl --resolution 24 -o out.{suffix} --json -" for suffix in ("npz", "npy", "vti")),
    "render ball.stl --size 64x48 -o out.png -v",
    "minkowski ball.stl bead.stl --resolution 16 -v --json out.json",
    "report sheet.stl network.stl --resolution 16 --tortuosity-resolution 16 --unit mm --json - -o out",
    "report sheet.stl --compare network.stl --resolution 16 --tortuosity-resolution 16 --unit mm -o out",
)
# Lines of a text in which the self-test changes a digit, and places of other files.
CHANGED_LINES, CHANGED_BYTES = 40, 10


def wrapped(program: Path, folder: Path, versions: tuple[str, str], inputs: dict[str, bytes]) -> Iterator[tuple[str, bool]]:
    """Yields each disturbance of a program's run, and whether the comparison is right about it."""
    case = complete("intersect ball.stl block.off --resolution 24 -v -o out.stl")
    for i, (what, code, is_found) in enumerate(DISTURBANCES):
        wrapper = folder / f"wrapper_{i}.py"
        text = WRAPPER.format(python=sys.executable, name=NAME, program=str(program), disturbance=code)
        wrapper.write_text(text, encoding="utf-8")
        wrapper.chmod(wrapper.stat().st_mode | stat.S_IXUSR)
        found = Pair(program, wrapper, versions, inputs).differences(case)
        yield what, bool(found) == is_found


def changed_parts(part: str, content: bytes, version: str) -> Iterator[tuple[str, bytes]]:
    """Yields changes of a part that the comparison has to find: a digit in a line that no mask alters, or a byte."""
    if not is_text(part):
        for i in range(CHANGED_BYTES):
            at = i * (len(content) - 1) // (CHANGED_BYTES - 1)
            yield f"byte {at}", content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :]
        return
    lines = content.split(b"\n")
    kept = mask(part, content, version).split(b"\n")
    figures = [i for i, line in enumerate(lines) if line == kept[i] and re.search(rb"\d", line)]
    for i in figures[:: len(figures) // CHANGED_LINES + 1]:
        line = re.sub(rb"\d", lambda digit: b"%d" % ((int(digit[0]) + 1) % 10), lines[i], count=1)
        yield f"line {i + 1}", b"\n".join([*lines[:i], line, *lines[i + 1 :]])


def self_test(program: Path, version: str, inputs: dict[str, bytes], folder: Path) -> bool:
    """Disturbs results, and returns whether the comparison finds every disturbance and calls two runs of OLD the same."""
    versions = (version, version)
    wrong, count = [], 0
    for what, is_right in wrapped(program, folder, versions, inputs):
        count += 1
        if not is_right:
            wrong.append(f"wrong about {what}")
    kinds: dict[str, list[int]] = collections.defaultdict(lambda: [0, 0])
    for line in SAMPLES:
        case = complete(line)
        first, second = (run(program, case, inputs) for _ in range(2))
        wrong += [f"two runs differ: {case}: {found.part}" for found in compare(first, second, versions)]
        for part, content in first.parts.items():
            masked = mask(part, content, version)
            # A mask that removed whole lines would hide more than it names.
            if masked.count(b"\n") != content.count(b"\n"):
                wrong.append(f"masks join lines: {case}: {part}")
                continue
            tally = kinds[Path(part).suffix or part]
            if is_text(part):
                tally[0] += sum(x != y for x, y in zip(content.split(b"\n"), masked.split(b"\n")))
                tally[1] += content.count(b"\n")
            for what, changed in changed_parts(part, content, version):
                count += 1
                if not compare(Outcome(0, {part: content}), Outcome(0, {part: changed}), versions):
                    wrong.append(f"not found: {case}: {part}: {what}")
    expected = "stdout stderr .json .csv .txt .html .stl .obj .ply .off .glb .3mf .npz .npy .vti .png".split()
    wrong += [f"no result has {kind}" for kind in expected if kind not in kinds]
    for kind, (masked, lines) in sorted(kinds.items()):
        if lines:
            print(f"{kind}: masks alter {masked} of {lines} lines")
    for what in wrong:
        print(what)
    print(f"self-test: {count} disturbances, {len(wrong)} mistakes")
    return not wrong


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("--before", type=Path, required=True, help="the built command line that is right")
    arguments.add_argument("--after", type=Path, help="the built command line to compare with it")
    arguments.add_argument("--only", default="", metavar="TEXT", help="only command lines that contain this")
    arguments.add_argument("--jobs", type=int, default=2, metavar="N", help="command lines that run at once [default: 2]")
    arguments.add_argument("--self-test", action="store_true", help="disturb results of OLD and see that it shows")
    arguments.add_argument("--numbers", action="store_true", help="compare JSON, tables, images and meshes, and no words")
    arguments.add_argument("--verbose", action="store_true", help="a line for every command line")
    options = arguments.parse_args()
    if options.after is None and not options.self_test:
        arguments.error("--after is missing")
    for program in filter(None, (options.before, options.after)):
        if not os.access(program, os.X_OK):
            arguments.error(f"{program} is no program")
    before = options.before.resolve()
    with tempfile.TemporaryDirectory(prefix="same_bits_inputs_") as name:
        inputs = make_inputs(before, Path(name))
        if options.self_test:
            sys.exit(0 if self_test(before, version_of(before), inputs, Path(name)) else 1)
        after = options.after.resolve()
        cases = [case for case in all_cases() if options.only in str(case)]
        if not cases:
            arguments.error(f"no command line contains '{options.only}'")
        pair = Pair(before, after, (version_of(before), version_of(after)), inputs, options.numbers)
        sys.exit(0 if compare_all(pair, cases, options.jobs, options.verbose) else 1)


if __name__ == "__main__":
    main()
