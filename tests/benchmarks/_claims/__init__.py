"""The numbers of the tutorials' performance tables, measured with this library. Each module measures one subject; `claims` collects them."""
