"""x."""
from generator.assets.people.body import Body
def simple_body() -> Body:
    """X."""
    raise ValueError
