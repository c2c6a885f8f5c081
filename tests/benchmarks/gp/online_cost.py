def exchange():
    return True


def predictions():
    return True
