# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # From a scene to a model
#
# A probe is pressed on tissue with a stiff inclusion in it. This page solves such a press, and then a hundred more. On
# those it trains the paper's inverse network, which answers what a simulated probe records on a phantom.
#
# Run it as a script (`.venv/bin/python docs/from_scene_to_model.py`, two minutes on two quiet cores), or open it as a
# notebook with jupytext. It writes into `build/from_scene_to_model`. **Everything here is simulated.**

# %%
import os
from pathlib import Path

import numpy as np

import host_tools as tsis
from host_tools.calibration.calibrate import calibrate
from host_tools.commands.model import phantoms_of

OUT = Path("build/from_scene_to_model")
SCENES = int(os.environ.get("SCENES", 134))  # the paper's number; 75 is about the fewest that can be trained on
TRIALS = int(os.environ.get("TRIALS", 20))  # the paper averages 100 networks
OUT.mkdir(parents=True, exist_ok=True)

# %% [markdown]
# ## 1. A scene, solved
#
# Size is the diameter of the inclusion, depth the distance from the surface to its *top*. A tolerance is a ratio: 0.05
# allows an error of 5 % on the three numbers that describe what the inclusion does to the face of the probe. The plan
# says which model that takes, and why. In a notebook the last line shows all that as a table, beside each number the
# error that this very solve is estimated to have. Were it more than the tolerance on any level, the call would fail
# and say what was reached.

# %%
truth = tsis.Inclusion(size_mm=12.0, depth_mm=6.0, youngs_modulus_kpa=60.0)
scene = tsis.Scene(truth, tsis.Press(force_n=0.5))
solution = tsis.solve(scene, tolerance=0.05)
for choice, reason in solution.plan.reasons.items():
    print(f"{choice:12} {reason}")
solution.plot().savefig(OUT / "press.png")
print(solution)
solution

# %% [markdown]
# The middle panel is what the inclusion *adds*: some tens of micrometres on a face that moves by two tenths of a
# millimetre. All that follows has to be read off that small difference. As a data set, with the unit of each number:

# %%
print(solution.to_xarray())

# %% [markdown]
# ## 2. Many scenes
#
# Random inclusions of the paper's box (0-15 mm, 4-12 mm deep, 40-120 kPa), each pressed with the same force. They are
# solved in small strain, as the paper did, and all at one level of the elements. Interrupted, the same line goes on.

# %%
swept = tsis.sweep(SCENES, OUT / "sweep.nc")
solved = swept.where(swept.reason == "", drop=True)
print(f"{solved.sizes['scene']} of {SCENES} scenes solved")
for name in ("size_mm", "depth_mm", "youngs_modulus_kpa"):
    together = float(np.corrcoef(solved[name], solved.max_deformation_mm)[0, 1])
    print(f"{name:20} goes with the largest deformation by a correlation of {together:+.2f}")

# %% [markdown]
# Size and depth show in the deformation. Young's modulus hardly does: from 40 to 120 kPa the middle of the face moves
# by less than 5 %, since next to tissue of 5 kPa either is all but rigid.
#
# ## 3. A model
#
# The paper's network has 3 inputs, 10 and 4 hidden neurons and 3 outputs, and is trained by scaled conjugate gradients.
# Nine scenes are kept apart. `export` writes ONNX and a card, and loads them as the probe does: with a check of hash,
# contract and golden vectors.

# %%
trained = tsis.train(OUT / "sweep.nc", trials=TRIALS)
bundle = tsis.export(trained, OUT / "model")
for name, errors in bundle.card["held_out_errors_percent"].items():
    if name in ("size_mm", "depth_mm", "youngs_modulus_kpa"):
        print(f"{name:20} mean error on the nine scenes {errors['mean']:6.2f} %")

# %% [markdown]
# ## 4. The probe sees pixels, not micrometres
#
# So the model needs a calibration: recordings of nine phantoms of known inclusions give three straight lines from the
# image's features to those that the network knows. Their residuals become the intervals. The phantoms are those of the
# committed model, which span the box; a calibration of phantoms that do not is refused.

# %%
probe = tsis.simulated_probe()
phantoms = phantoms_of(tsis.installed_models().paper)
recordings = [tsis.phantom_recording(one, probe, seed=100 + i) for i, one in enumerate(phantoms)]
certificate = calibrate(recordings, bundle, probe.centred, force_n=0.5).certificate

# %% [markdown]
# ## 5. A press, and its answer
#
# The phantom of step 1, recorded with noise of camera, hand and load cell, and analysed as the probe would.

# %%
press = tsis.phantom_recording(truth, probe, seed=7)
if not (OUT / "press").exists():
    tsis.write_recording(press, OUT / "press")  # a folder; the probe keeps the same as one .zip
answer = tsis.analyse(press, models=tsis.ModeModels(bundle), calibration=certificate)
print(f"status {answer.status}: {answer.reason}")
print(f"{'':20} {'truth':>8} {'answer':>8}   90 % interval")
for name in ("size_mm", "depth_mm", "youngs_modulus_kpa"):
    quantity, known = getattr(answer, name), getattr(truth, name)
    verdict = "" if quantity.identifiable else "  (not determined)"
    print(f"{name:20} {known:8.2f} {quantity.value:8.2f}   {quantity.low:.2f} to {quantity.high:.2f}{verdict}")

# %% [markdown]
# ## What this means, and what it does not
#
# - **Size and depth are found, the modulus is not.** Three numbers of one press at one force do not determine three
#   unknowns; the answer says so itself (`partly_identifiable`) instead of showing a number as if it were known.
# - **The training world is not the recorded one.** The network has learnt from small strain; the recording comes from
#   finite strain and scattered light. The three lines of the calibration take up part of that, and the intervals are
#   wide because of the rest.
# - **One phantom is an anecdote.** `host_tools evaluate --scenes 60` scores the committed model on sixty.
# - **It is no patient.** Tissue here is homogeneous, elastic and flat, the inclusion a sphere.
#
# How well *any* method could do is a bound that needs no network (Cramer-Rao). It is the standard deviation of each
# unknown by the whole image of ten such frames, where tissue, skin and light are not exactly known. Those of the
# phantom above were. A bound beyond some 50 % only says "not known".

# %%
bound = tsis.limits(scene, tsis.PressProtocol(forces_n=(0.5,), strain="small", systematic_ratio=0.002))
for name, std in zip(("size_mm", "depth_mm", "youngs_modulus_kpa"), bound.std_with_box, strict=True):
    print(f"{name:20} cannot be known better than to {100 * std:5.1f} %")

# %% [markdown]
# The modes standard and precise press with a rising force and read the whole face, which is where the modulus begins to
# show: [docs/modes.md](modes.md) says how much.
