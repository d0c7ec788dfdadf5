"""3D replay of robots in the browser: one self-contained page, a fragment of another, or live."""
