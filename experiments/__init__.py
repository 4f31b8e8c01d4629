"""Where robot and world meet: the see-think-act loop, recorders, scoring and command lines."""
