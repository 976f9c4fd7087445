"""The skier: anthropometry, skeleton, kinematic chain, inverse dynamics."""
