# docker build -t gen-data . && docker run --rm -v "$PWD:/data" gen-data --config tabletop.yaml --n 100
FROM python:3.11-slim-bookworm AS build
COPY . /src
# The wheel brings compiled kernels, so that the first sample does not wait for them.
RUN pip install --no-cache-dir /src \
    && cd /src && python -m gen_data.renderers.warp.kernel_bundle
RUN pip wheel --no-cache-dir --no-deps --wheel-dir /wheels /src

FROM python:3.11-slim-bookworm
ARG EXTRAS=all
COPY --from=build /wheels /wheels
RUN pip install --no-cache-dir "$(ls /wheels/*.whl)[$EXTRAS]" \
    && useradd --create-home --uid 1000 gen-data \
    && install -d -o gen-data -g gen-data /data /home/gen-data/.cache
USER gen-data
WORKDIR /data
# Compiled kernels and staged shards; a volume keeps them between containers.
ENV WARP_CACHE_PATH=/home/gen-data/.cache/warp
VOLUME ["/home/gen-data/.cache"]
ENTRYPOINT ["gen-data"]
CMD ["--help"]
