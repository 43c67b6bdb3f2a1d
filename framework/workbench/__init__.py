"""A contact law by itself: driven, measured, drawn and checked."""
