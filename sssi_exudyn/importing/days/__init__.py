"""Days of skiing: long tracks split into runs, and the exports of telephones' apps."""
