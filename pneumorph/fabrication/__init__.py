"""What a workshop needs to build a design: moulds, hub, parts list."""
