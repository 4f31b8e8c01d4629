"""What the parts of a run cost, each beside what it could cost: experiments.benchmark."""
