; What the expressions work on. Read by CLIPS 6.30 and by ours.

(defglobal ?*v* = nothing ?*done* = FALSE ?*n* = 0)

(deftemplate t "a comment"
  (slot a)
  (slot b (type INTEGER) (default 7))
  (slot c (type SYMBOL) (allowed-symbols red green) (default red))
  (slot f (type FLOAT))
  (slot s (type STRING))
  (multislot m))

(deftemplate u
  (slot x (default-dynamic (* 2 3)))
  (multislot y (default 1 2 "z")))

(deffacts d "facts"
  (t (a 1) (m a b "c"))
  (t (a 2) (b 3) (f 1e15) (s "text"))
  (o x 1.5 "s")
  (o)
  (u))

(defclass C (is-a USER) (role concrete)
  (slot s (create-accessor read-write))
  (slot n (type INTEGER) (range 0 10) (default 1))
  (multislot ms (create-accessor read-write)))

(defmessage-handler C twice (?x) (* 2 ?x))

(definstances i
  ([c1] of C (s 1) (ms a "b" 2.5))
  ([c2] of C))

(defrule r "a rule" (declare (salience 5)) (t (a ?x) (b ?y&:(> ?y 2))) (not (gone)) => (printout t "fired " ?x crlf))
(defrule r2 (o $?x) => (assert (seen ?x)))

(deffunction id (?x) ?x)
(deffunction idm ($?x) $?x)
(deffunction no-value () (printout nil ""))
(deffunction kind ()
  (if (eq ?*v* (no-value)) then (return VOID))
  (if (instance-namep ?*v*) then (return INSTANCE-NAME))
  (type ?*v*))
(deffunction the-fact () (nth$ 1 (find-fact ((?f t)) TRUE)))
(deffunction the-ordered () (nth$ 1 (find-fact ((?f o)) TRUE)))
(deffunction the-instance () (instance-address [c1]))
(deffunction add (?x ?y) (+ ?x ?y))
(defgeneric g)
(defmethod g ((?x INTEGER)) (* 2 ?x))
(defmethod g ((?x LEXEME)) (sym-cat ?x ?x))

(deffunction begin (?n)
  (setgen 1)
  (reset)
  (seed 7)
  (set-strategy depth)
  (set-fact-duplication FALSE)
  (set-reset-globals TRUE)
  (set-salience-evaluation when-defined)
  (set-sequence-operator-recognition FALSE)
  (set-dynamic-constraint-checking FALSE)
  (set-class-defaults-mode convenience)
  (set-current-module MAIN)
  (printout t crlf "@begin " ?n crlf))

(deffunction finish ()
  (printout t crlf "@value " ?*done* " " (kind) crlf ?*v* crlf "@facts" crlf)
  (facts)
  (printout t "@instances" crlf)
  (instances)
  (printout t "@agenda" crlf)
  (agenda)
  (printout t "@end" crlf))
