# SPDX-License-Identifier: GPL-3.0-or-later
"""The registry's entries describe the methods that they build, and load them only when they are used."""

import subprocess
import sys
from pathlib import Path

import pytest

from laboratory.speed.candidates import trials
from laboratory.speed.surfaces import FULL
from laboratory.study.traits import DEFAULT_METHODS, TRAITS
from precompute.base.failure import GratingError
from precompute.methods import method_registry
from precompute.methods.method import Settings
from precompute.methods.method_registry import ENTRIES
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import blazed

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture(scope="module")
def built():
    grating = prepare(blazed(periods=2, rows=24))
    settings = Settings(coherence_length_m=5e-6)
    return {name: entry.build(grating, settings) for name, entry in ENTRIES.items()}


@pytest.mark.parametrize("name", ENTRIES)
def test_an_entry_tells_what_its_method_is(built, name):
    entry, method = ENTRIES[name], built[name]
    assert (method.name, method.coherence) == (name, entry.coherence)
    assert method.table_bytes > 0 or name == "gem"
    if not TRAITS[name].has_spectrum:
        with pytest.raises(GratingError):
            method.density(0.1, 0.0, 1.5, wavelength_m=500e-9)


@pytest.mark.parametrize("name", ENTRIES)
def test_an_entry_tells_whether_a_shader_can_evaluate_it(built, name):
    """PQ as printed has the images of PQ, but no shader."""
    if ENTRIES[name].has_shader:
        assert built[name].shader_images().images.terms.nbytes == built[name].table_bytes
    elif name != "pq-printed":
        with pytest.raises(GratingError, match="no shader"):
            built[name].shader_images()


def test_the_lists_are_those_of_the_entries():
    assert list(TRAITS) == list(ENTRIES)
    assert DEFAULT_METHODS == (
        "reference", "reference-patch", "flss", "chebyshev", "nmm", "pq", "pq-printed", "stam"
    )  # fmt: skip
    assert set(method_registry.METHODS) - set(method_registry.MAP_METHODS) == {"reference-patch"}
    assert method_registry.SHADER_METHODS == ("flss", "chebyshev", "nmm", "nmm-jacobian", "pq")


def test_the_trials_of_a_method_differ():
    tried = [(name, trial.label) for name in ENTRIES for trial in trials(name, FULL)]
    assert len(set(tried)) == len(tried) > 20


@pytest.mark.parametrize(
    "statement",
    [
        "from precompute.cli import parser; parser.build_parser(['info'])",
        "import precompute.methods.dft_layout",
    ],
)
def test_the_methods_are_loaded_only_where_they_are_wanted(statement):
    script = f"{statement}; import sys; assert 'precompute.methods.method_registry' not in sys.modules"
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
