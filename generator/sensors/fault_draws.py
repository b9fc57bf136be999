"""Random streams and instants of faults of sensors.

A fault changes the readings of a sensor, never their labels. Each reading states its faults as
plain data, and ``labels.jsonl`` has them. Faults have their own random streams: without them a
reading has the same bytes.
"""

import numpy as np
from pydantic import Field

from gen_data.config.base_model import Strict
from gen_data.core.se3 import Array
from gen_data.core.streams import Rng


class Rare(Strict):
    """Base of faults that begin at random instants, as radioactive decays do (Poisson process).

    Attributes:
        per_minute: Mean number in a minute.
    """

    per_minute: float = Field(ge=0, le=600)

    def begin_s(self, rng: Rng, until_s: float) -> Array:
        """Instants [s] from 0 to ``until_s``, [n]; the first ones are the same for each end."""
        times: list[float] = []
        time_s = 0.0
        while self.per_minute > 0.0:
            time_s += float(rng.exponential(60.0 / self.per_minute))
            if time_s > until_s:
                break
            times.append(round(time_s, 6))
        return np.array(times)


def fault_stream(rng: Rng) -> Rng:
    """The stream of the faults of the sensor that has the stream ``rng``, at the same step."""
    return rng.streams.rng(f"{rng.name}/faults")
