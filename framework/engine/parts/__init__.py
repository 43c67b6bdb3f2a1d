"""The parts of a running specimen: each with its arrays, its passes, its share for a thread and its energy."""
