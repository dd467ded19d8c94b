"""The JSON schemas of the documents that tactid writes; they are files in this package."""

import json
from importlib import resources
from typing import Any


def calibration_schema() -> dict[str, Any]:
    """Returns the JSON schema of calibrations, which describes every key with its unit.

    :meth:`Calibration.to_json` returns such a document.

    >>> tactid.calibration_schema()["properties"]["schema"]["const"]
    'tactid.calibration/2'
    """
    return _schema("calibration")


def combination_schema() -> dict[str, Any]:
    """Returns the JSON schema of the results of several recordings.

    :meth:`Combination.to_json` returns such a document. Each of its recordings contains a document
    of :func:`result_schema`.

    >>> tactid.combination_schema()["properties"]["schema"]["const"]
    'tactid.combination/1'
    """
    found, single = _schema("combination"), result_schema()
    definitions = single.pop("$defs")
    del single["$schema"]
    return found | {"$defs": found["$defs"] | definitions | {"result": single}}


def motion_schema() -> dict[str, Any]:
    """Returns the JSON schema of designed motions, which describes every key with its unit.

    :meth:`DesignedMotion.to_json` returns such a document.

    >>> tactid.motion_schema()["properties"]["schema"]["const"]
    'tactid.motion/1'
    """
    return _schema("motion")


def result_schema() -> dict[str, Any]:
    """Returns the JSON schema of results, which describes every key with its unit and frame.

    Every JSON document of tactid names its version under ``schema``; :meth:`Identification.to_json`
    returns one.

    >>> tactid.result_schema()["properties"]["schema"]["const"]
    'tactid.result/1'
    """
    return _schema("result")


def _schema(name: str) -> dict[str, Any]:
    text = resources.files("tactid").joinpath(f"{name}.schema.json").read_text("utf-8")
    found: dict[str, Any] = json.loads(text)
    return found
