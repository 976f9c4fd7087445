"""What one ski feels of the snow: contact point, cutting edge, groove, ground, boot joint."""
