#!/bin/sh
# Inputs to begin with, one folder a target, from the files that are committed.
set -eu
cd "$(dirname "$0")"
frameworks=../../codegen/nn/tests/frameworks
mkdir -p corpus/import corpus/emit corpus/network corpus/model corpus/rig corpus/frame corpus/recording corpus/wiring corpus/log corpus/mechanism
for file in $frameworks/models/*.onnx $frameworks/models/*.h5 $frameworks/models/*.keras \
    $frameworks/models/*.tflite $frameworks/hostile/*; do
    case $file in
        *.onnx) first='\000' ;;
        *.h5) first='\001' ;;
        *.keras) first='\002' ;;
        *) first='\003' ;;
    esac
    { printf "$first"; cat "$file"; } > "corpus/import/$(basename "$file")"
done
for file in corpus/import/*.onnx; do cp "$file" corpus/emit/; done
for folder in ../../models/reference-*; do
    { cat "$folder/model.toml"; printf '\000'; cat "$folder/weights.safetensors"; } > "corpus/model/$(basename "$folder")"
done
cp ../../rigs/*.toml corpus/rig/
cp ../../docs/reference/*.wiring.toml corpus/wiring/
for file in ../foreign/logs/*; do case $file in *.csv) ;; *) cp "$file" corpus/log/ ;; esac; done
cp ../foreign/mechanism/*.xml ../foreign/mechanism/*.urdf corpus/mechanism/
for file in ../../rigs/*.csv; do head -n 40 "$file" > "corpus/recording/$(basename "$file")"; done
printf 't,u_V,"q, m"\n0,,1\n0.1,5e-1,nan\n' > corpus/recording/missing.csv
# A sample of two outputs, a probe, a prediction: the message's number, then lengths and numbers.
printf '\001\007\002\000\000\200\077\000\000\000\100\000\001\000\000\200\077' > corpus/frame/sample
printf '\003\002\000\000\200\077\000\000\000\100' > corpus/frame/probe
printf '\002\001\000\000\200\077\001\000\000\200\077' > corpus/frame/prediction
# A printed folder of each framework network, where the program is there to write it.
if command -v sinew > /dev/null; then
    for file in $frameworks/models/*.onnx $frameworks/models/*.keras; do
        name=$(basename "$file")
        sinew import "$file" --out "corpus/folder" > /dev/null
        { cat corpus/folder/network.toml; printf '\000'; cat corpus/folder/weights.safetensors; } > "corpus/network/$name"
        rm -r corpus/folder
    done
fi
