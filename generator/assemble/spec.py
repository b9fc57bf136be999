"""Spec: a whole configuration, read, merged with its template, and validated.

A configuration names a template and overrides its elements; the resolved document has both, so it
says everything about a data set and is what ``plan.json`` keeps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, model_validator

from generator.annotations.truth import Thresholds
from generator.assemble.tables import TABLES
from generator.config.document import (
    MappingNode,
    Node,
    ScalarNode,
    SequenceNode,
    load,
    merge,
    parse,
    with_override,
)
from generator.config.problems import Problems
from generator.config.strict import Strict
from generator.config.validation import validate
from generator.core.errors import ConfigError, did_you_mean
from generator.physics import PhysicsConfig
from generator.renderers import RenderSettings
