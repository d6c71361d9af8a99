# Image with the program morgana and the Python package, built from a clone:
#   docker build -t morgana .
#   docker run --rm -v "$PWD:/work" morgana render scenes/grid_lens.xml -o lens.exr
FROM rust:1.90-slim-bookworm AS build
RUN apt-get update \
    && apt-get install --yes --no-install-recommends python3-pip python3-venv \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /src
COPY . .
RUN cargo install --locked --path crates/cli --root /opt/morgana
RUN python3 -m venv /opt/maturin \
    && /opt/maturin/bin/pip install --no-cache-dir "maturin>=1.9,<2" \
    && /opt/maturin/bin/maturin build --release --locked --out /opt/wheels

FROM python:3.13-slim-bookworm
COPY --from=build /opt/morgana/bin/morgana /usr/local/bin/morgana
COPY --from=build /opt/wheels /opt/wheels
RUN pip install --no-cache-dir /opt/wheels/*.whl && rm -r /opt/wheels
WORKDIR /work
ENTRYPOINT ["morgana"]
CMD ["--help"]
