"""The command line tells assumed sizes in its own words, since it loads no estimator before it runs."""

from inspect import signature

import pytest

from asflown.cli import options
from asflown.cli.inertia.fit import fit
from asflown.estimate.inertia.tensor import RATE_SCALE
from asflown.estimate.subject import INERTIA_SHARE, SPIN_SHARE
from asflown.kit.quantities import quantity


@pytest.mark.parametrize(("option", "size"), [(options.SPIN_SIGMA, SPIN_SHARE), (options.INERTIA_SIGMA, INERTIA_SHARE)])
def test_the_help_tells_what_is_assumed(option, size):
    assert option.help.endswith(f"as a share; {size:g}.")


@pytest.mark.parametrize(("name", "size"), [("wheel_error", SPIN_SHARE), ("rate_error", RATE_SCALE)])
def test_the_default_is_what_is_assumed(name, size):
    assert quantity(signature(fit).parameters[name].default.default, "") == pytest.approx(size, rel=1e-12)
