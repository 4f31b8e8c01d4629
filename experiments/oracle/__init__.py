"""How short a tour could be for somebody who knows the building: a yardstick, see docs/oracle.md.

Nothing that a robot decides may depend on any of this.
"""
