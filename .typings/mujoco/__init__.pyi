# MuJoCo's Python bindings are compiled and ship no type information.
from typing import Any

def __getattr__(name: str) -> Any: ...
