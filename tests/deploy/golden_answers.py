"""Prints what every network of the installed models gives for its golden features on this machine, as JSON."""

from __future__ import annotations

import json

import numpy as np

from device.files.shipped import MODELS
from device.measurement.bundle import CARD_FILE, open_session


def golden_answers() -> dict[str, dict[str, list[list[float]]]]:
    answers = {}
    for card in sorted(MODELS.glob(f"*/{CARD_FILE}")):
        rows = np.array(json.loads(card.read_text(encoding="utf-8"))["golden"]["features"], np.float32)
        for network in sorted(card.parent.glob("*.onnx")):
            session = open_session(network.read_bytes())
            names = [port.name for port in session.get_outputs()]
            outputs = session.run(names, {"features": rows.reshape(len(rows), -1)})
            found = {name: np.asarray(one, np.float64).tolist() for name, one in zip(names, outputs, strict=True)}
            answers[f"{card.parent.name}/{network.name}"] = found
    return answers


if __name__ == "__main__":
    print(json.dumps(golden_answers()))
